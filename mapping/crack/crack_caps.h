// The walls of a crack: the portion inside the part of each square between boxes of two fragments.
#pragma once
#include "mapping/crack/crack_split.h"

namespace flexel::mapping {

// A triangle on one side of a square.
struct CrackCap {
  std::uint32_t fragment = 0;
  Index3 box{};                            // that it bounds
  std::array<std::uint32_t, 3> corners{};  // nodes of the mesh, seen from outside the box
};

// What stood in the way; another shift may help, unless the surface crosses itself.
enum class CapOutcome { done, degenerate, crosses_itself };

// The edges of the squares, as far as they are inside. Finds where the surface meets them, gives these points
// to `mesh`, whose surface must be closed; before CrackMesh::insert_points().
class CrackEdges {
 public:
  [[nodiscard]] CapOutcome find(CrackMesh& mesh);
  // For a surface that stays open: only gives `mesh` the points where the sides of squares inside a fragment
  // meet the surface, so that a cut ends where its crack does.
  void find_ends(CrackMesh& mesh);
  // The stretches inside the part of one side of a square, as pairs of nodes, end to end.
  // `along`: its direction; `planes` (of the other two axes, ascending); `box`: along it.
  [[nodiscard]] std::span<const std::array<std::uint32_t, 2>> of(int along, int first_plane, int second_plane,
                                                                 int box) const;

 private:
  using Line = std::array<int, 3>;   // along, planes of the other two axes, ascending
  using Place = std::array<int, 4>;  // a line, and the box along it
  struct Pierce {
    double at;  // u along the line
    std::uint32_t triangle;
    bool leaves;  // the part, going up the line
  };
  void list_places(const CrackBoxes& boxes, bool inside_only);
  void pierce(const CrackMesh& mesh);
  void make_stretches(CrackMesh& mesh, std::size_t place);

  std::vector<Place> places_;                 // ascending
  std::vector<Line> lines_;                   // ascending
  std::vector<std::vector<Pierce>> pierces_;  // (lines)
  std::vector<std::array<std::uint32_t, 2>> stretches_;
  std::vector<std::uint32_t> offset_;                        // (places + 1)
  std::unordered_map<std::uint64_t, std::uint32_t> corner_;  // nodes on three planes
};

// Gives bits and caps in mixed boxes their fragments: what is connected in a box is of one, and the cells
// under its surface say which. `polygon_of`: (triangles of the mesh).
void resolve_mixed(const Body& body, const std::vector<std::uint32_t>& polygon_of,
                   const Components& fragments, CrackMesh& mesh, std::vector<CrackCap>& caps);

// After CrackMesh::insert_points(). Walls inside a fragment get points of their own between those that both
// sides share at the end of the crack, so that they can open.
[[nodiscard]] CapOutcome make_caps(CrackMesh& mesh, const CrackEdges& edges, std::vector<CrackCap>& caps);

}  // namespace flexel::mapping
