// Which cell of the parent a cell lies in: that of its voxel; of several pieces there the one that the same polygons bound.
#include "simulate/quadratic/submodel.h"

#include <algorithm>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/stop.h"
#include "simulate/matter/fragments.h"
#include "simulate/models/cells.h"
#include "simulate/quadratic/corotation.h"
#include "simulate/quadratic/quadratic_newton.h"

namespace flexel::simulate {
namespace {

// Nodes in the middle of a cell's faces x-, x+, y-, y+, z-, z+.
constexpr std::array<std::size_t, 6> kMiddleOfFace = {12, 14, 10, 16, 4, 22};

Index3 lowest_of(const Body& body, std::uint32_t cell) {
  return body.lattice_index[body.cell_elements[cell][0]];
}

Vec3 to_point(const Index3& index) {
  return {static_cast<double>(index[0]), static_cast<double>(index[1]), static_cast<double>(index[2])};
}

// The voxel of a lattice `ratio` times as coarse.
Index3 voxel_around(const Index3& index, int ratio) {
  Index3 coarse;
  for (std::size_t axis = 0; axis < 3; ++axis)
    coarse[axis] = (index[axis] - (index[axis] < 0 ? ratio - 1 : 0)) / ratio;
  return coarse;
}

bool is_in(const LatticeBox& box, const Index3& voxel) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (voxel[axis] < box.lower[axis] || voxel[axis] >= box.upper[axis]) return false;
  return true;
}

Vec3 place_of_node(std::size_t n) {
  return 0.5 * Vec3(static_cast<double>(n % 3), static_cast<double>(n / 3 % 3), static_cast<double>(n / 9));
}

// (cells) the polygons that bound each of those asked for.
std::map<std::uint32_t, std::vector<std::uint32_t>> polygons_of(const Body& body,
                                                                const std::vector<std::uint8_t>& asked) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> found;
  for (std::uint32_t p = 0; p + 1 < body.surface_cell_offsets.size(); ++p)
    for (std::uint32_t i = body.surface_cell_offsets[p]; i < body.surface_cell_offsets[p + 1]; ++i)
      if (asked[body.surface_cells[i]]) found[body.surface_cells[i]].push_back(p);
  return found;
}

Body with_part_of(Body body, const Part& parent) {
  body.parts.front().material = parent.material;
  body.parts.front().surface_volume = parent.surface_volume;
  return body;
}

}  // namespace

// The parent's cells in a box.
class Submodel::ParentCells {
 public:
  ParentCells(const QuadraticSystem& parent, const LatticeBox& box, int ratio, const Body& own)
      : own_(own),
        ratio_(ratio),
        body_(parent.problem().body),
        nodes_(parent.nodes()),
        cut_(parent.cut_nodes()) {
    std::vector<std::uint8_t> several(body_.cell_count(), 0), asks(own.cell_count(), 0);
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c)
      if (const Index3 voxel = lowest_of(body_, nodes_.cells[c]); is_in(box, voxel)) in_[voxel].push_back(c);
    for (const auto& each : in_)
      for (const std::uint32_t c : each.second) several[nodes_.cells[c]] = each.second.size() > 1;
    for (std::uint32_t c = 0; c < own.cell_count(); ++c)
      if (const auto found = in_.find(voxel_around(lowest_of(own, c), ratio)); found != in_.end())
        asks[c] = found->second.size() > 1;
    polygons_ = polygons_of(body_, several);
    own_polygons_ = polygons_of(own, asks);
  }

  // Nothing: the parent has left that matter out. `unknown`: it lies in one of several.
  [[nodiscard]] std::optional<std::uint32_t> around(std::uint32_t cell, bool& unknown) const {
    unknown = false;
    const auto found = in_.find(voxel_around(lowest_of(own_, cell), ratio_));
    if (found == in_.end()) return std::nullopt;
    if (found->second.size() == 1) return found->second.front();
    const auto mine = own_polygons_.find(cell);
    std::optional<std::uint32_t> best;
    std::size_t most = 0;
    for (const std::uint32_t c : found->second) {
      const auto theirs = polygons_.find(nodes_.cells[c]);
      if (mine == own_polygons_.end() || theirs == polygons_.end()) continue;
      std::vector<std::uint32_t> both;
      std::set_intersection(mine->second.begin(), mine->second.end(), theirs->second.begin(),
                            theirs->second.end(), std::back_inserter(both));
      if (both.size() <= most) continue;
      most = both.size();
      best = c;
    }
    unknown = !best;
    return best;
  }

  // Whether matter goes on beyond a face of a cell: in another one, or where the parent was cut itself.
  [[nodiscard]] bool goes_on(std::uint32_t cell, std::size_t face) const {
    const std::uint32_t node = nodes_.of_cell[cell][kMiddleOfFace[face]];
    return nodes_.at(node).size() > 1 || std::binary_search(cut_.begin(), cut_.end(), node);
  }
  [[nodiscard]] Vec3 lowest(std::uint32_t cell) const {
    return to_point(lowest_of(body_, nodes_.cells[cell]));
  }

 private:
  const Body& own_;
  int ratio_;
  const Body& body_;
  const QuadraticNodes& nodes_;
  const std::vector<std::uint32_t>& cut_;
  std::map<Index3, std::vector<std::uint32_t>> in_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> polygons_, own_polygons_;
};

LatticeBox Submodel::finer(const LatticeBox& box, int ratio) {
  LatticeBox fine = box;
  fine.lattice.spacing /= ratio;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    fine.lower[axis] *= ratio;
    fine.upper[axis] *= ratio;
  }
  return fine;
}

Submodel::Submodel(const QuadraticSystem& parent, Body body, const LatticeBox& box, int ratio,
                   const Scene& scene)
    : parent_(parent),
      ratio_(ratio),
      parent_box_(box),
      box_(finer(box, ratio)),
      body_(with_part_of(std::move(body), parent.problem().body.parts.front())),
      problem_{body_,
               parent.problem().materials,
               stray_cells(find_fragments(body_)),
               parent.problem().models,
               {},
               {},
               {},
               {}},
      scene_(scene) {
  surroundings_.box = {to_point(box_.lower), to_point(box_.upper)};
  surroundings_.cut_nodes = [this](const QuadraticNodes& nodes) { return find_cut(nodes); };
  surroundings_.beyond = [this](const std::vector<std::uint32_t>& polygons) {
    std::vector<FacePoint> points = parent_.all_points(polygons);
    std::erase_if(points, [this](const FacePoint& point) { return !is_beyond(point); });
    return points;
  };
  system_ = std::make_unique<QuadraticSystem>(problem_, scene, &surroundings_);
}

// By the middle of the matter that it is of: a point on a face of the box belongs to the side that its cell lies on.
bool Submodel::is_beyond(const FacePoint& point) const {
  const Lattice& lattice = parent_box_.lattice;
  Vec3 at = lattice.to_lattice(point.position);
  const Vec3 outward = (lattice.axes.transpose() * point.area_vector).normalized();
  constexpr double kInwards = 1e-6;  // spacings
  at -= kInwards * outward;
  return (at.array() < to_point(parent_box_.lower).array()).any() ||
         (at.array() > to_point(parent_box_.upper).array()).any();
}

std::vector<std::uint32_t> Submodel::find_cut(const QuadraticNodes& nodes) {
  const ParentCells parent(parent_, parent_box_, ratio_, body_);
  std::vector<std::uint8_t> is_cut(nodes.size(), 0);
  std::vector<std::optional<Anchor>> anchor(nodes.size());
  for (std::uint32_t c = 0; c < nodes.cells.size(); ++c) {
    const Index3 low = lowest_of(body_, nodes.cells[c]);
    bool unknown = false, beside_cut = false;
    const std::optional<std::uint32_t> around = parent.around(nodes.cells[c], unknown);
    for (std::size_t face = 0; face < 6; ++face) {
      const std::size_t axis = face / 2, end = face % 2;
      if (low[axis] != (end == 0 ? box_.lower[axis] : box_.upper[axis] - 1)) continue;
      beside_cut = true;
      if (!around || !parent.goes_on(*around, face)) continue;
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        if (place_of_node(n)[static_cast<Eigen::Index>(axis)] == static_cast<double>(end))
          is_cut[nodes.of_cell[c][n]] = 1;
    }
    if (unknown && (beside_cut || ratio_ == 1))
      throw InputError("several walls lie in one cell beside the place that is looked at");
    for (std::size_t n = 0; around && n < kQuadraticNodes; ++n)
      anchor[nodes.of_cell[c][n]] = {nodes.of_cell[c][n], *around,
                                     (to_point(low) + place_of_node(n)) / ratio_ - parent.lowest(*around)};
  }
  std::vector<std::uint32_t> cut;
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    if (anchor[n]) all_.push_back(*anchor[n]);
    if (!is_cut[n]) continue;
    cut_.push_back(*anchor[n]);
    cut.push_back(n);
  }
  return cut;
}

Vec3 Submodel::value(const Anchor& anchor, const std::vector<Vec3>& displacement) const {
  const QuadraticShape shape = quadratic_shape(anchor.at);
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    sum += shape.value[n] * displacement[parent_.nodes().of_cell[anchor.cell][n]];
  return sum;
}

void Submodel::solve(const std::vector<Vec3>& displacement, bool turns) {
  std::vector<Vec3> led;
  for (const Anchor& each : cut_) led.push_back(value(each, displacement));
  system_->lead_cut_nodes(std::move(led));
  if (turns)
    solve_turned(displacement);
  else
    solve_small();
}

void Submodel::solve_small() {
  // beside what it takes to lead the cut faces from rest: matter that moves far is strained little
  constexpr double kTight = 1e-9;
  const auto progress = [](int, double) { check_stop(); };
  if (solution_.tangent == nullptr)
    solution_ = flexel::simulate::solve(*system_, kTight, 1, scene_.name, progress);
  else if (!correct(*system_, kTight, solution_, progress))
    throw DivergedError("the cells around the largest stress did not converge");
}

// From the parent's field, or from the last equilibrium; with the preconditioner of a linear solution, which finds how
// far that has to reach.
void Submodel::solve_turned(const std::vector<Vec3>& displacement) {
  constexpr int kAttempts = 3;
  constexpr double kRough = 1e-3;
  const auto linear = [](int, double) { check_stop(); };
  const auto large = [](double, double) { check_stop(); };
  for (int n = 0; n < kAttempts; ++n) {
    if (solution_.tangent == nullptr) {
      solution_ = flexel::simulate::solve(*system_, kRough, solution_.safety, scene_.name, linear);
      interpolate(displacement);
    }
    if (follow_turns(*system_, scene_.run, scene_.name, large, solution_)) return;
    solution_.tangent.reset();
    solution_.safety *= kMoreSafety;
  }
  throw DivergedError("the cells around the largest stress did not converge");
}

// Where the parent has left the matter out: as the rest of the cell.
void Submodel::interpolate(const std::vector<Vec3>& displacement) {
  const QuadraticNodes& nodes = system_->nodes();
  solution_.displacement.assign(nodes.size(), Vec3::Zero());
  std::vector<std::uint8_t> known(nodes.size(), 0);
  for (const Anchor& each : all_) {
    solution_.displacement[each.node] = value(each, displacement);
    known[each.node] = 1;
  }
  for (const auto& cell : nodes.of_cell) {
    const auto from = std::find_if(cell.begin(), cell.end(), [&](std::uint32_t n) { return known[n] == 1; });
    for (const std::uint32_t n : cell)
      if (known[n] == 0 && from != cell.end()) {
        solution_.displacement[n] = solution_.displacement[*from];
        known[n] = 2;
      }
  }
}

void Submodel::take(const std::vector<Vec3>& displacement, double safety, bool turns) {
  solution_.safety = safety;
  if (solution_.tangent == nullptr)
    solution_.tangent = std::make_unique<QuadraticTangent>(system_->stiffness(safety));
  QuadraticOperator& stiffness = solution_.tangent->stiffness;
  interpolate(displacement);
  if (turns) {
    if (!Corotation(*system_, stiffness, safety).residual(solution_.displacement, 1, solution_.unbalanced))
      throw DivergedError("a cell around the largest stress is inside out");
    return;
  }
  solution_.unbalanced.assign(system_->nodes().size(), Vec3::Zero());
  stiffness.forces(solution_.displacement[0].data(), solution_.unbalanced[0].data());
  const std::vector<Vec3> wanted = system_->right_side(safety);
  for (std::size_t n = 0; n < wanted.size(); ++n)
    solution_.unbalanced[n] = wanted[n] - solution_.unbalanced[n];
}

void Submodel::add_pull(double factor, std::vector<Vec3>& to) const {
  for (const Anchor& each : cut_) {
    const QuadraticShape shape = quadratic_shape(each.at);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      to[parent_.nodes().of_cell[each.cell][n]] += factor * shape.value[n] * solution_.unbalanced[each.node];
  }
}

}  // namespace flexel::simulate
