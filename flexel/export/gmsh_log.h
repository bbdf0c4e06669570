// How far gmsh has come, from its log.
#pragma once
#include <string>
#include <string_view>

namespace flexel::mesh_export {

// Knows the lines of `gmsh -3 -v 5` for second-order meshes (version 4.8). Between them, where gmsh says nothing for
// long, it goes on at the pace that was.
class GmshLog {
 public:
  // What gmsh has written more by `seconds` after its beginning, which may end within a line.
  void add(std::string_view text, double seconds);
  // Of the work, in [0, 1].
  [[nodiscard]] double share(double seconds) const;

 private:
  void take(const std::string& line, double seconds);
  std::string open_;      // a line that has not ended
  std::size_t next_ = 0;  // step
  double began_ = 0;      // s: of the step that runs
  double inside_ = -1;    // share of that step; below 0: not told
};

}  // namespace flexel::mesh_export
