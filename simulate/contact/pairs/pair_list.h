// Candidate pairs: those that could touch before their elements have moved by a margin.
//
// A grid (simulate/contact/points/broad_phase.h) finds them. They are found again only after an element of the
// surface has moved by nearly half the margin against the others: common motion costs nothing.
#pragma once
#include "simulate/contact/pairs/contact_materials.h"
#include "simulate/contact/pairs/element_runs.h"
#include "simulate/contact/pairs/rest_overlaps.h"

namespace flexel::simulate {

// A row of simulate/kernels/kernel_contact.h.
struct alignas(64) ContactPair {
  static constexpr std::uint32_t kOfPlane = 0xffffffff;
  PairProperties properties;
  // m, penetration at rest of two parts that presses nothing (simulate/contact/pairs/rest_overlaps.h)
  double rest_overlap = 0;
  std::uint64_t key = 0;  // contact points, i << 32 | j; a plane is numbered behind the last point
  std::uint32_t i = 0, j = kOfPlane;  // numbers in PairList::points(); j kOfPlane: of a plane
  std::uint32_t plane = 0;

  [[nodiscard]] bool of_plane() const { return j == kOfPlane; }
};

class PairList {
 public:
  // `settings` and `surface` outlive this.
  PairList(const ContactSettings& settings, const Problem& problem, const ContactSurface& surface);

  // Finds the pairs anew where that is due; `ahead`: also where the way of the next step may make it so.
  // Returns whether it was.
  bool update(const State& state, bool ahead);
  // Likewise for an implicit step, which would lead from `before` to `aimed` without forces: the list has room for
  // half more. `way` [m]: how far the surfaces go against one another in it, at most.
  bool update_ahead(const State& before, double way);
  [[nodiscard]] double way(const State& before, const State& aimed) const;
  // Whether other pairs may touch than those of the list.
  [[nodiscard]] bool outgrown(const State& state) { return is_due(state, false); }
  // m/s, velocities of the elements when update() was asked ahead last.
  [[nodiscard]] const Box& speeds() const { return speeds_; }

  [[nodiscard]] const std::vector<ContactPair>& pairs() const { return pairs_; }  // ascending by key
  // Contact points of pairs, ascending, and the elements that carry them, ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& points() const { return points_; }
  [[nodiscard]] const std::vector<std::uint32_t>& elements() const { return elements_; }
  [[nodiscard]] const std::vector<ElementRun>& runs() const { return runs_; }  // of elements()
  [[nodiscard]] const ContactPoint& point(std::uint32_t number) const {
    return surface_.points()[points_[number]];
  }
  [[nodiscard]] std::uint64_t builds() const { return builds_; }  // lists made so far
  [[nodiscard]] const ContactMaterials& materials() const { return materials_; }
  [[nodiscard]] const std::vector<UnsureFit>& unsure_fits() const { return rest_overlaps_.unsure(); }

  // For checkpoints: (ContactSurface::elements() x 3) m, displacements for which the list was made.
  [[nodiscard]] bool built() const { return built_; }
  [[nodiscard]] const std::vector<Vec3>& built_at() const { return built_at_; }
  // The list for such displacements, of the body as it is; without them it will be made by the next update().
  void rebuild_at(const std::vector<Vec3>* displacements);

 private:
  [[nodiscard]] bool is_due(const State& state, bool ahead, double way = 0);
  void build(const State& state);
  [[nodiscard]] double turning() const;
  [[nodiscard]] std::vector<std::uint32_t> points_of_near_parts(const std::vector<Vec3>& positions,
                                                                double farthest);
  [[nodiscard]] bool may_touch(std::uint32_t i, std::uint32_t j, const std::vector<Vec3>& positions,
                               const std::vector<Vec3>& normals) const;
  void add_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals);
  void add_plane_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals);
  void number_points();

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  ContactMaterials materials_;
  ExcludedPairs excluded_;
  RestOverlaps rest_overlaps_;
  std::vector<ContactPair> pairs_;
  std::vector<std::uint32_t> points_, elements_;
  std::vector<ElementRun> runs_, surface_runs_;  // of elements_; of all that carry points
  std::vector<Vec3> built_at_;
  std::vector<std::array<WideBox, 2>> boxes_;  // of is_due()
  bool built_ = false;
  std::size_t built_with_ = 0;  // broken cells
  double skin_;                 // m, margin
  double slack_ = 0;            // m, that elements may move before other pairs can touch
  std::uint64_t builds_ = 0;
  Box speeds_;
};

}  // namespace flexel::simulate
