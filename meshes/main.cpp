// flexel-meshes: reads meshes with libraries that may crash, loop or take all memory over a damaged file. A job on stdin,
// its answer on stdout (formats/common/mesh_job.h); the other programs start it, and limit its time and memory.
#include <unistd.h>

#include <exception>

#include "base/error.h"
#include "formats/common/mesh_job.h"
#include "meshes/amf_reader.h"
#include "meshes/assimp_reader.h"
#include "meshes/vdb_reader.h"

namespace flexel::meshes {
namespace {

ForeignMesh read(const MeshReadJob& job, const Warn& warn) {
  if (job.format == "vdb") return read_level_sets(job, warn);
  if (job.format == "amf") return read_amf(job, warn);
  return read_with_assimp(job, warn);
}

Bytes do_job(const Bytes& bytes) {
  const MeshReadJob job = unpack_mesh_job(bytes);
  JobAnswer<ForeignMesh> answer;
  const Warn warn = [&](const std::string& line) { answer.warnings.push_back(line); };
  try {
    answer.result = read(job, warn);
  } catch (const InputError& error) {
    answer.refused = true;
    answer.where = error.where();
    answer.why = error.what();
  }
  return pack(answer);
}

}  // namespace
}  // namespace flexel::meshes

int main() {
  _exit(flexel::serve_job(
      "flexel-meshes", flexel::meshes::do_job));  // what the libraries would tidy up is gone with the process
}
