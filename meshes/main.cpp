// flexel-meshes: reads meshes, and writes OpenVDB files, with libraries that take long to load, and may crash, loop or take
// all memory over a damaged file. A job on stdin, its answer on stdout (formats/common/mesh_job.h); the other programs
// start it, and limit its time and memory.
#include <unistd.h>

#include "formats/common/mesh_job.h"
#include "formats/lattice/body_file.h"
#include "meshes/amf_reader.h"
#include "meshes/assimp_reader.h"
#include "meshes/vdb_reader.h"
#include "meshes/vdb_writer.h"

namespace flexel::meshes {
namespace {

ForeignMesh read(const MeshReadJob& job, const Warn& warn) {
  if (job.format == "vdb") return read_level_sets(job, warn);
  if (job.format == "amf") return read_amf(job, warn);
  return read_with_assimp(job, warn);
}

Bytes do_job(const Bytes& bytes) {
  const MeshJob job = unpack_mesh_job(bytes);
  if (job.write)
    return pack(answer_of<VdbFile>(
        [&](const Warn&) { return VdbFile{vdb_of(read_body(job.write->body, "the body"))}; }));
  return pack(answer_of<ForeignMesh>([&](const Warn& warn) { return read(*job.read, warn); }));
}

}  // namespace
}  // namespace flexel::meshes

int main() {
  // What the libraries would tidy up is gone with the process.
  _exit(flexel::serve_job("flexel-meshes", [](const flexel::Bytes& job, const flexel::TellShare&) {
    return flexel::meshes::do_job(job);
  }));
}
