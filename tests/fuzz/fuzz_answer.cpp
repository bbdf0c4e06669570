// Mutated jobs and answers of the programs that read files for others: those crash over damaged files, so what they say is
// not believed.
#include <algorithm>

#include "formats/cad/cad_job.h"
#include "formats/common/mesh_job.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/tetrahedron.h"

namespace {

using namespace flexel;

// The first byte says what the others are.
Bytes with_kind(char kind, const Bytes& bytes) {
  Bytes all(1 + bytes.size(), static_cast<std::byte>(kind));
  std::copy(bytes.begin(), bytes.end(), all.begin() + 1);
  return all;
}

std::vector<Bytes> corpus() {
  JobAnswer<CadMesh> mesh;
  mesh.result.surface = fuzz::tetrahedron();
  mesh.warnings = {"a line"};
  mesh.result.face_colors.assign(3 * mesh.result.surface.faces.size(), 0.5);
  JobAnswer<CadWritten> written;
  written.result.files = {{fuzz::bytes_of("ISO-10303-21;"), 1}};
  written.result.missed = {{"bracket/12", 1e-6}};
  JobAnswer<ForeignMesh> foreign;
  foreign.result.vertices = mesh.result.surface.vertices;
  foreign.result.polygon_offsets = mesh.result.surface.polygon_offsets;
  foreign.result.polygon_vertices = mesh.result.surface.polygon_vertices;
  foreign.result.polygon_part.assign(4, 0);
  foreign.result.polygon_group.assign(4, 0);
  foreign.result.part_names = {"a"};
  foreign.result.group_names = {"g"};
  return {with_kind('c', pack(mesh)),
          with_kind('w', pack(written)),
          with_kind('m', pack(foreign)),
          with_kind('v', pack(JobAnswer<VdbFile>{})),
          with_kind('j', pack(CadReadJob{"step", fuzz::bytes_of("ISO"), "a", "a", 1e-3, {}, 0.1, 1})),
          with_kind('k', pack(MeshReadJob{"amf", "amf", fuzz::bytes_of("<amf>"), "a"}))};
}

void unpack(const std::string& path) {
  const Bytes all = read_all(path);
  const auto bytes = std::span<const std::byte>(all).subspan(1);
  switch (static_cast<char>(all[0])) {
    case 'c': {
      auto answer = unpack_mesh(bytes, path);
      static const std::vector<SurfaceSource> sources = fuzz::tetrahedron().sources;  // stay with who asks
      answer.result.surface.sources = sources;
      answer.result.surface.part_source.assign(answer.result.surface.parts.size(), 0);
      if (!answer.refused) check(answer.result.surface, path);
      break;
    }
    case 'w':
      (void)unpack_written(bytes, path);
      break;
    case 'm':
      (void)unpack_foreign_mesh(bytes, path);
      break;
    case 'v':
      (void)unpack_vdb(bytes, path);
      break;
    case 'j':
      (void)unpack_job(bytes);
      break;
    default:
      (void)unpack_mesh_job(bytes);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_answer", corpus(), unpack);
}
