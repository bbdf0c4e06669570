// Mutated tables of points (CSV), moved and written again, and lists of frames (.pvd).
#include "mapping/anchors/other_surfaces.h"
#include "mapping/series.h"
#include "tests/fuzz/driver.h"

namespace {

using namespace flexel;

constexpr const char* kPoints =
    "# gauges\nname,x,y,z,note\na,1.5,2,3,left\nb,-1e-3,0,7,\"right\"\n\nc,1,2,3,\n";
constexpr const char* kPlain = "1;2;3\n4;5;6;7\n";
constexpr const char* kSeries =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\"><Collection>\n<DataSet "
    "timestep=\"0\" part=\"0\" "
    "file=\"run_00000.vtu\"/>\n<DataSet timestep=\"0.5\" file=\"run_00001.vtu\"/>\n</Collection></VTKFile>\n";

void read_table(const std::string& path) {
  const Bytes bytes = read_all(path);
  if (bytes[0] == std::byte{'<'}) {
    (void)mapping::series_files(path);
    return;
  }
  const mapping::PointTable table = mapping::read_points(path, 1e-3);
  std::vector<Vec3> displacement;
  for (const Vec3& p : table.points) displacement.emplace_back(p.y(), 0, 1e-3);
  (void)mapping::moved_points(table, displacement, 1e-3);
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_table",
                   {fuzz::bytes_of(kPoints), fuzz::bytes_of(kPlain), fuzz::bytes_of(kSeries)}, read_table);
}
