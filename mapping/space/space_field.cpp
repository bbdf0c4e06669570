// Near the elements the method decides; far from them, level by level, cubes of elements with Wendland weights of
// twice the cube's width, and at last the part as a whole. A level takes over where the weights of the one before it
// fall below kFaint, by a polynomial that is flat at both ends, so that phi stays twice continuously differentiable.
#include "mapping/space/space_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "base/error.h"
#include "formats/lattice/locate.h"
#include "formats/lattice/quadratic_field.h"
#include "mapping/anchors/blend_weights.h"

namespace flexel::mapping {
namespace {

constexpr double kFaint = 0.05;    // weight of all together; in a cell it is above 1
constexpr double kOverlap = 0.25;  // of a cell, on either side of its faces

struct Sum {
  Vec3 value = Vec3::Zero();
  double weight = 0;
  void add(double w, const Vec3& v) {
    value += w * v;
    weight += w;
  }
};

// 1 inside a cell, 0 from kOverlap outside it on; those of two neighbours sum up to 1.
double cell_weight(const Vec3& at) {
  double weight = 1;
  for (int axis = 0; axis < 3 && weight > 0; ++axis)
    weight *= smooth_step((at[axis] + kOverlap) / (2 * kOverlap)) *
              smooth_step((1 + kOverlap - at[axis]) / (2 * kOverlap));
  return weight;
}

// The affine motion of some elements about their middle.
struct Motion {
  Vec3 centre = Vec3::Zero(), displacement = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
  double count = 0;
  void add(const Vec3& rest, const ElementMotion& motion) {
    centre += rest;
    displacement += motion.displacement;
    gradient += motion.gradient;
    count += 1;
  }
  void finish() {
    centre /= count;
    displacement /= count;
    gradient /= count;
  }
  [[nodiscard]] Vec3 at(const Vec3& x) const { return displacement + gradient * (x - centre); }
};

std::uint64_t key_of(const std::array<std::int64_t, 3>& cube) {
  constexpr std::uint64_t kBits = 21, kMask = (std::uint64_t{1} << kBits) - 1;
  std::uint64_t key = 0;
  for (const std::int64_t each : cube) key = key << kBits | (static_cast<std::uint64_t>(each) & kMask);
  return key;
}

}  // namespace

struct SpaceField::Cells {
  explicit Cells(const Body& body) : displacement(body.element_count()) {
    for (std::size_t e = 0; e < displacement.size(); ++e) displacement[e] = body.position[e] - body.rest[e];
    field.emplace(body, displacement);
  }
  std::vector<Vec3> displacement;  // (elements x 3) m
  std::optional<QuadraticField> field;
};

struct SpaceField::Groups {
  struct Level {
    double width = 0;  // spacings
    std::unordered_map<std::uint64_t, Motion> cubes;
  };
  std::vector<Level> levels;
  Motion all;

  Groups(const Body& body, std::uint32_t part, const std::vector<ElementMotion>& motions) {
    const Part& own = body.parts[part];
    Box box;
    for (std::uint32_t e = own.element_begin; e < own.element_end; ++e) {
      box.add(own.lattice.to_lattice(body.rest[e]));
      all.add(body.rest[e], motions[e]);
    }
    all.finish();
    for (double width = 2; width < box.size().maxCoeff(); width *= 2) {
      Level level{width, {}};
      for (std::uint32_t e = own.element_begin; e < own.element_end; ++e)
        level.cubes[key_of(cube_of(own.lattice.to_lattice(body.rest[e]), width))].add(body.rest[e],
                                                                                      motions[e]);
      for (auto& [key, cube] : level.cubes) cube.finish();
      levels.push_back(std::move(level));
    }
  }

  static std::array<std::int64_t, 3> cube_of(const Vec3& at, double width) {
    std::array<std::int64_t, 3> cube{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      cube[axis] = static_cast<std::int64_t>(std::floor(at[static_cast<Eigen::Index>(axis)] / width));
    return cube;
  }

  // The cubes of one level around x (at: in the lattice).
  static Sum sum(const Level& level, const Lattice& lattice, const Vec3& x, const Vec3& at) {
    Sum found;
    const std::array<std::int64_t, 3> home = cube_of(at, level.width);
    for (std::int64_t n = 0; n < 125; ++n) {
      const auto cube =
          level.cubes.find(key_of({home[0] + n % 5 - 2, home[1] + n / 5 % 5 - 2, home[2] + n / 25 - 2}));
      if (cube == level.cubes.end()) continue;
      const double away = (lattice.to_lattice(cube->second.centre) - at).norm() / (2 * level.width);
      if (away < 1) found.add(wendland(away), cube->second.at(x));
    }
    return found;
  }
};

SpaceField::SpaceField(const Body& body, MapMethod method, double scale)
    : body_(body), scale_(scale), map_(body) {
  if (method == &kShapeFunctions) {
    if (!QuadraticField::is_in(body))
      throw InputError(
          "--method shape-functions needs a body that model \"quadratic\" deformed; take another --method");
    polynomials_ = std::make_unique<Cells>(body);
  } else if (method != &kBlended) {
    throw InputError("--method " + name_of(method) +
                     " is not smooth between vertices, which surfaces need: take blended");
  }
  for (std::uint32_t part = 0; part < body.parts.size(); ++part)
    groups_.emplace_back(body, part, map_.motions());
}

SpaceField::~SpaceField() = default;

SpaceField::Probe::Probe(const SpaceField& field) : field_(field), probe_(field.map_) {}

SpaceField::Probe::Near SpaceField::Probe::blended(const Vec3& x, std::uint32_t part,
                                                   std::optional<std::size_t> polygon) {
  const SpaceMap::Value value = probe_.place(x, part, polygon);
  return {value.position - x, value.in_radius ? value.weight : 0};
}

SpaceField::Probe::Near SpaceField::Probe::of_cells(const Vec3& x, std::uint32_t part,
                                                    std::optional<std::size_t> polygon) {
  const Body& body = field_.body_;
  const std::optional<std::uint32_t> home = probe_.cell_at(x, part, polygon);
  if (!home) return {};
  if (home != home_) {
    home_ = home;
    cells_.clear();
    for (const std::uint32_t element : body.cell_elements[*home])
      for (const std::uint32_t cell : field_.map_.cells_of(element))
        if (std::find(cells_.begin(), cells_.end(), cell) == cells_.end()) cells_.push_back(cell);
  }
  Sum sum;
  for (const std::uint32_t cell : cells_) {
    const Vec3 at = cell_coordinates(body, body.parts[part], cell, x);
    if (const double weight = cell_weight(at); weight > 0)
      sum.add(weight, field_.polynomials_->field->displacement(cell, at));
  }
  if (!(sum.weight > 0)) return {};
  return {sum.value / sum.weight, sum.weight};
}

Vec3 SpaceField::Probe::far(const Vec3& x, std::uint32_t part) const {
  const Groups& groups = field_.groups_[part];
  const Lattice& lattice = field_.body_.parts[part].lattice;
  const Vec3 at = lattice.to_lattice(x);
  Vec3 displacement = Vec3::Zero();
  double left = 1;  // of the weight that the levels share
  for (const Groups::Level& level : groups.levels) {
    const Sum sum = Groups::sum(level, lattice, x, at);
    if (!(sum.weight > 0)) continue;
    const double share = left * smooth_step(sum.weight / kFaint);
    displacement += share * (sum.value / sum.weight);
    left -= share;
    if (!(left > 0)) return displacement;
  }
  return displacement + left * groups.all.at(x);
}

Vec3 SpaceField::Probe::at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon) {
  const Near near = field_.polynomials_ ? of_cells(x, part, polygon) : blended(x, part, polygon);
  const double share = near.weight > 0 ? smooth_step(near.weight / kFaint) : 0;
  Vec3 displacement = share * near.displacement;
  if (share < 1) displacement += (1 - share) * far(x, part);
  return x + field_.scale_ * displacement;
}

}  // namespace flexel::mapping
