// gmsh runs as a child process in a folder of its own and writes its format 2.2, in text: the one that every
// version of it writes.
#include "flexel/export/gmsh.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <unordered_map>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "flexel/export/gmsh_log.h"
#include "flexel/process/child.h"

namespace flexel::mesh_export {
namespace {

constexpr int kTriangle6 = 9, kTetrahedron10 = 11;

// The last line that gmsh marked as an error, without its mark.
std::string last_error(const std::string& log) {
  std::ifstream file(log);
  std::string found = "it says nothing";
  for (std::string line; std::getline(file, line);)
    if (const std::size_t at = line.find("Error   : "); at != std::string::npos) found = line.substr(at + 10);
  return found;
}

class Msh {
 public:
  explicit Msh(const std::string& path) : bytes_(read_all(path)) {
    text_ = std::string_view(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
  }
  // Goes on after the line `name`.
  void section(const char* name) {
    at_ = text_.find(name, at_);
    if (at_ == std::string_view::npos) throw std::runtime_error(fmt::format("gmsh's mesh has no {}", name));
    at_ = text_.find('\n', at_) + 1;
  }
  double number() {
    char* end = nullptr;
    const double value = std::strtod(text_.data() + at_, &end);
    const auto stop = static_cast<std::size_t>(end - text_.data());
    if (stop == at_ || stop > text_.size()) throw std::runtime_error("gmsh's mesh is not readable");
    at_ = stop;
    return value;
  }
  long whole() { return static_cast<long>(number()); }

 private:
  Bytes bytes_;
  std::string_view text_;
  std::size_t at_ = 0;
};

int nodes_of(long type) {
  constexpr std::array<int, 16> counts = {0, 2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1};
  if (type < 1 || type >= static_cast<long>(counts.size()))
    throw std::runtime_error(fmt::format("gmsh's mesh has elements of type {}", type));
  return counts[static_cast<std::size_t>(type)];
}

GmshMesh read_msh(const std::string& path) {
  Msh file(path);
  GmshMesh mesh;
  std::unordered_map<long, std::uint32_t> index;
  file.section("$Nodes");
  for (long n = file.whole(); n > 0; --n) {
    index[file.whole()] = static_cast<std::uint32_t>(mesh.nodes.size());
    const double x = file.number(), y = file.number(), z = file.number();
    mesh.nodes.emplace_back(x, y, z);
  }
  file.section("$Elements");
  for (long n = file.whole(); n > 0; --n) {
    (void)file.whole();
    const long type = file.whole(), tags = file.whole();
    int entity = 0;
    for (long t = 0; t < tags; ++t) {
      const long tag = file.whole();
      if (t == 1) entity = static_cast<int>(tag);
    }
    std::array<std::uint32_t, 27> nodes{};
    for (int i = 0; i < nodes_of(type); ++i) nodes[static_cast<std::size_t>(i)] = index.at(file.whole());
    if (type == kTriangle6) {
      GmshTriangle triangle{{}, entity};
      std::copy_n(nodes.begin(), 6, triangle.nodes.begin());
      mesh.triangles.push_back(triangle);
    } else if (type == kTetrahedron10) {
      GmshTetrahedron tetrahedron{{}, entity};
      std::copy_n(nodes.begin(), 10, tetrahedron.nodes.begin());
      std::swap(tetrahedron.nodes[8], tetrahedron.nodes[9]);  // gmsh has edge 23 before 13
      mesh.tetrahedra.push_back(tetrahedron);
    }
  }
  return mesh;
}

}  // namespace

GmshMesh mesh_with_gmsh(const std::string& folder, const std::string& script, const std::string& part,
                        Progress& progress) {
  write_text(script, folder + "/mesh.geo");
  const std::string gmsh = find_program("gmsh");
  if (gmsh.empty())
    throw InputError(
        "--mesh tet needs the program gmsh, which is not installed: install Debian's package gmsh, or use "
        "--mesh hex");
  ChildOptions options;
  options.log = folder + "/log";
  options.folder = folder;
  GmshLog log;
  std::ifstream written;
  options.meanwhile = [&, began = std::chrono::steady_clock::now()] {
    if (!written.is_open()) written.open(options.log);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    log.add(std::string(std::istreambuf_iterator<char>(written), {}), seconds);
    written.clear();  // gmsh goes on where it ended
    progress.update(log.share(seconds));
  };
  const ChildRun run =
      run_child({gmsh, "mesh.geo", "-3", "-format", "msh22", "-o", "mesh.msh", "-v", "5"}, options);
  const std::string mesh_file = folder + "/mesh.msh";
  GmshMesh mesh;
  if (run.exit_code == 0 && std::filesystem::exists(mesh_file)) mesh = read_msh(mesh_file);
  if (mesh.tetrahedra.empty())
    throw InputError(part, fmt::format("gmsh cannot fill it with tetrahedra ({}); use another --size, or "
                                       "--mesh hex, which broken surfaces do not stop",
                                       last_error(folder + "/log")));
  return mesh;
}

}  // namespace flexel::mesh_export
