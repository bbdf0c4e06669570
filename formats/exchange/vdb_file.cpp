// The body goes to flexel-meshes as a body file.
#include "formats/exchange/vdb_file.h"

#include "base/files/output_file.h"
#include "base/parallel.h"
#include "base/resources.h"
#include "formats/common/mesh_job.h"
#include "formats/lattice/body_file.h"

namespace flexel {

void write_vdb(const Body& body, const std::string& path) {
  const VdbWriteJob job{body_bytes(body)};
  ChildLimits limits;  // sound input of our own: it takes seconds
  limits.processor = 3600 * static_cast<double>(thread_count());
  limits.wall = 3 * 3600;
  limits.memory = available_memory();
  const JobWords words{"write it as VDB", "its lattice is unsound", "its lattice is too much",
                       "a larger --size takes less"};
  const Bytes answer = run_job({"flexel-meshes", "OpenVDB", "OpenVDB"}, pack(job), limits, path, words);
  const VdbFile file = result_of(unpack_vdb(answer, path), path, nullptr);
  OutputFile out(path);
  out.write(file.bytes.data(), file.bytes.size());
  out.commit();
}

}  // namespace flexel
