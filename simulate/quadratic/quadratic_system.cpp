// Cells by their moments; only what supports add to a cell is a matrix.
#include "simulate/quadratic/quadratic_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/human.h"
#include "base/math/area_vector.h"
#include "base/math/dense.h"
#include "base/parallel.h"
#include "formats/lattice/cell_moments.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/followers/pressing_load.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/matter/surface_samples.h"
#include "simulate/models/cells.h"
#include "simulate/quadratic/cells/matter_points.h"
#include "simulate/thermal/thermal.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kWhole = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kIntegratedCellsAtATime = 16;

Moments body_moments(const Body& body, std::size_t place) {
  return Eigen::Map<const Moments>(&body.moments[place * kMoments]);
}

}  // namespace

QuadraticSystem::QuadraticSystem(const Problem& problem, const Scene& scene, const Surroundings* surroundings)
    : problem_(problem),
      scene_(scene),
      nodes_(quadratic_nodes(problem.body, active_cells(problem))),
      cut_{surroundings, {}, {}} {
  if (cut_.surroundings != nullptr) cut_.nodes = cut_.surroundings->cut_nodes(nodes_);
  cut_.displacement.assign(cut_.nodes.size(), Vec3::Zero());
  const Body& body = problem.body;
  const std::vector<std::uint32_t> part = cell_parts(body);
  for (const std::uint32_t c : nodes_.cells) {
    part_.push_back(part[c]);
    const auto found = std::lower_bound(body.moment_cells.begin(), body.moment_cells.end(), c);
    moments_at_.push_back(found != body.moment_cells.end() && *found == c
                              ? static_cast<std::uint32_t>(found - body.moment_cells.begin())
                              : kWhole);
  }
  require_moments();
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Law law = law_of(problem.materials[p]);
    moduli_.push_back(elasticity(law, Mat3::Zero()));
    // of an orthotropic material the largest eigenvalue of dP/dF
    stiffest_.push_back(law.name == LawName::orthotropic ? law.stiffest : law.lambda + 2 * law.mu);
  }
  pressure_.assign(body.surface.polygon_count(), 0);
  free_ = FreeStrain(body, scene.get<Thermal>(), problem.materials);
  place_supports();
  place_bonds(scene.get<Bonds>());
  if (heated()) integrate_free_strain();
  place_loads(scene.get<Loads>().loads);
  if (const auto& acceleration = scene.get<Gravity>().acceleration) add_gravity(*acceleration);
}

void QuadraticSystem::require_moments() const {
  const Body& body = problem_.body;
  for (std::size_t i = 0; i < nodes_.cells.size(); ++i)
    if (moments_at_[i] == kWhole && body.fill[nodes_.cells[i]] < kWholeFill)
      throw InputError(
          scene_.name,
          fmt::format("model \"quadratic\" needs the exact moments of cells that the surface of part "
                      "\"{}\" cuts, which this body does not have: voxelize with --moments",
                      body.parts[part_[i]].name));
}

void QuadraticSystem::place_supports() {
  ties_ = scene_.get<Supports>().ties;
  const std::size_t given = ties_.size();
  rigidity_ = RigidParts::rigidity(scene_.get<RigidParts>(), problem_.body);
  for (std::size_t p = 0; p < rigidity_.size(); ++p)
    if (rigidity_[p] != Rigidity::none) {
      Tie& tie = ties_.emplace_back();
      tie.name = problem_.body.parts[p].name;
      tie.origin = scene_.name;
      tie.link = LinkLoad{};
    }
  for (std::size_t t = 0; t < given; ++t) place_support(ties_[t], resolve(ties_[t].where, problem_.body));
  refuse_on_rigid_parts();
  for (std::size_t p = 0, t = given; p < rigidity_.size(); ++p) {
    if (rigidity_[p] == Rigidity::none) continue;
    Selected whole;
    for (std::uint32_t e = problem_.body.parts[p].element_begin; e < problem_.body.parts[p].element_end; ++e)
      whole.elements.push_back(e);
    place_support(ties_[t++], whole);
  }
  make_links();
  integrate_supports();
}

void QuadraticSystem::place_support(const Tie& tie, const Selected& selected) {
  NitscheSupport support{&tie, {}, {}};
  for (const std::uint32_t p : selected.polygons) pressure_[p] = kUnknownPressure;
  if (!selected.polygons.empty()) {
    support.points =
        in_firm_cells(problem_.body, nodes_, face_points(problem_, nodes_, selected.polygons, box()));
    if (support.points.empty() && cut_.surroundings == nullptr)
      throw InputError(
          tie.origin, fmt::format("\"{}\": no matter lies under the selected surface; use a smaller spacing, "
                                  "or another face where this one is of a crumb that hangs on nothing",
                                  tie.name));
  }
  std::vector<std::uint8_t> chosen(problem_.body.element_count(), 0);
  for (const std::uint32_t e : selected.elements) chosen[e] = 1;
  // a node between elements is held where all of them are
  std::vector<std::uint8_t> free(nodes_.size(), 0);
  for (std::size_t c = 0; !selected.elements.empty() && c < nodes_.cells.size(); ++c)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      for (std::size_t a = 0; a < 8; ++a)
        if (trilinear_weight(n, a) > 0 && !chosen[problem_.body.cell_elements[nodes_.cells[c]][a]])
          free[nodes_.of_cell[c][n]] = 1;
  for (std::uint32_t n = 0; !selected.elements.empty() && n < nodes_.size(); ++n)
    if (!free[n]) support.nodes.push_back(n);
  supports_.push_back(std::move(support));
}

// Faces of a rigid part may be held: by the springs of the penalty.
void QuadraticSystem::refuse_on_rigid_parts() const {
  for (const NitscheSupport& support : supports_) {
    bool elements = false, linked = false;
    std::vector<std::uint8_t> held(nodes_.size(), 0);
    for (const std::uint32_t n : support.nodes) held[n] = 1;
    for (std::size_t c = 0; c < nodes_.cells.size(); ++c)
      for (const std::uint32_t n : nodes_.of_cell[c]) elements |= is_rigid(c) && held[n] != 0;
    for (const FacePoint& point : support.points) linked |= support.tie->link && is_rigid(point.cell);
    if (elements || linked)
      throw InputError(support.tie->origin,
                       fmt::format("\"{}\" {}: model \"quadratic\" holds a rigid part by its faces only",
                                   support.tie->name,
                                   linked ? "is a rigid link on a rigid part, which needs none"
                                          : "selects elements of a rigid part"));
  }
}

// A link leaves nodes to others that hold them.
void QuadraticSystem::make_links() {
  std::vector<std::uint8_t> taken(nodes_.size(), 0);
  for (const NitscheSupport& support : supports_)
    for (const std::uint32_t n : support.nodes)
      if (!support.tie->link) taken[n] = 1;
  std::size_t t = 0;
  for (NitscheSupport& support : supports_) {
    Tie& tie = ties_[t++];
    if (!tie.link) continue;
    std::erase_if(support.nodes, [&](std::uint32_t n) { return taken[n] != 0; });
    for (const std::uint32_t n : support.nodes) taken[n] = 1;
    tie.motion.link = make_link(support);
    tie.is_move = true;
  }
  for (const NitscheSupport& support : supports_)
    if (support.tie->link) linked_.push_back(&support);
}

std::shared_ptr<RigidLink> QuadraticSystem::make_link(const NitscheSupport& support) const {
  const Tie& tie = *support.tie;
  std::vector<LoadedPoint> points;
  for (const FacePoint& point : support.points) points.push_back({point.position, point.area_vector.norm()});
  std::vector<double> matter(support.nodes.empty() ? 0 : nodes_.size(), 0);  // m^3
  for (std::size_t c = 0; c < nodes_.cells.size() && !matter.empty(); ++c) {
    const auto volumes = shape_integrals(lattice(c).spacing.prod(), moments(c));
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) matter[nodes_.of_cell[c][n]] += volumes[n];
  }
  for (const std::uint32_t n : support.nodes)
    points.push_back({nodes_.rest[n], std::cbrt(matter[n] * matter[n])});
  const auto link = std::make_shared<RigidLink>();
  double total = 0, squared = 0;
  for (const LoadedPoint& point : points) {
    total += point.weight;
    link->middle += point.weight * point.position;
  }
  if (!(total > 0))
    throw InputError(tie.origin, fmt::format("\"{}\": a rigid link has no matter of its own", tie.name));
  link->middle /= total;
  Mat3 spread = Mat3::Zero();
  for (const LoadedPoint& point : points) {
    const Vec3 arm = point.position - link->middle;
    squared += point.weight * arm.squaredNorm();
    spread += point.weight * arm * arm.transpose();
  }
  link->reach = std::sqrt(squared / total);
  if (!(link->reach > 1e-9 * bounding_box(nodes_.rest).diagonal()))
    throw InputError(tie.origin, fmt::format("\"{}\": a rigid link needs more than one point", tie.name));
  constexpr double kOneLine = 1e-9;  // of the spread along it
  if (!(eigenvalues_symmetric(spread)[1] > kOneLine * squared))
    throw InputError(tie.origin,
                     fmt::format("\"{}\": what a rigid link leads lies on one line at this size, and nothing "
                                 "stops it from turning about that: select a wider region, or use a smaller "
                                 "--size",
                                 tie.name));
  link->at = tie.link->at.value_or(link->middle);
  link->force = tie.link->force;
  link->torque = tie.link->torque;
  link->follower = tie.link->follower;
  link->name = tie.name;
  link->origin = tie.origin;
  link->small = true;
  return link;
}

double QuadraticSystem::load_norm() const {
  std::vector<Vec3> sum(nodes_.size(), Vec3::Zero());
  for (const NodalLoad& load : loads_)
    for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += load.forces[n];
  double squared = 0;
  for (const Vec3& each : sum) squared += each.squaredNorm();
  for (const NitscheSupport* support : linked_) {
    const RigidLink& link = *support->tie->motion.link;
    const Vec3 moment = link.torque + (link.at - link.middle).cross(link.force);
    const auto bearing = static_cast<double>(support->points.size() + support->nodes.size());
    squared += std::pow(link.force.norm() + moment.norm() / link.reach, 2) / bearing;
  }
  return std::sqrt(squared);
}

void QuadraticSystem::integrate_supports() {
  cell_supports_.resize(nodes_.cells.size());
  for (const NitscheSupport& support : supports_)
    for (const FacePoint& point : support.points) {
      std::vector<SupportIntegrals>& there = cell_supports_[point.cell];
      if (there.empty() || there.back().support != &support) there.emplace_back().support = &support;
      there.back().points.push_back(&point);
    }
  parallel_for_each(
      nodes_.cells.size(),
      [&](std::size_t c) {
        for (SupportIntegrals& each : cell_supports_[c]) each.find(lattice(c), moduli_[part_[c]]);
      },
      kIntegratedCellsAtATime);
}

void QuadraticSystem::place_bonds(const Bonds::Parameters& parameters) {
  const Body& body = problem_.body;
  cell_bonds_.resize(nodes_.cells.size());
  if (body.parts.size() < 2) return;
  const std::vector<TouchingGap> named = Bonds::named_gaps(parameters, body);
  std::vector<std::uint8_t> touches(named.size(), 0);
  for (std::uint32_t a = 0; a < body.parts.size(); ++a)
    for (std::uint32_t b = a + 1; b < body.parts.size(); ++b) {
      double gap = 0;
      bool asked = parameters.bond;
      for (const TouchingGap& each : named)
        if (each.parts == std::array{a, b}) {
          gap = std::max(gap, each.gap);
          asked = true;
        }
      if (!asked) continue;
      CommonSurface common = common_surface(problem_, nodes_, {a, b}, gap);
      if (common.pairs.empty()) continue;
      if (!rigidity_.empty() && rigidity_[a] != Rigidity::none && rigidity_[b] != Rigidity::none)
        throw InputError(scene_.name, fmt::format("parts \"{}\" and \"{}\" touch and are both rigid: make "
                                                  "them one part, or one of them not rigid",
                                                  body.parts[a].name, body.parts[b].name));
      for (std::size_t n = 0; n < named.size(); ++n)
        if (named[n].parts == std::array{a, b}) touches[n] = 1;
      for (const std::uint32_t polygon : common.polygons) pressure_[polygon] = kUnknownPressure;
      std::move(common.pairs.begin(), common.pairs.end(), std::back_inserter(bonds_));
      bonded_parts_.push_back({{body.parts[a].name, body.parts[b].name}, common.area});
    }
  for (std::size_t n = 0; n < named.size(); ++n)
    if (!touches[n]) Bonds::refuse_apart(parameters.named[n]);
  for (std::uint32_t p = 0; p < bonds_.size(); ++p)
    for (std::uint32_t side = 0; side < 2; ++side) cell_bonds_[bonds_[p].cell[side]].push_back(2 * p + side);
  if (!bonds_.empty()) find_bearing_limits();
}

void QuadraticSystem::find_bearing_limits() {
  bearing_limit_.assign(nodes_.cells.size(), 0);
  const CellProducts<double> elastic = regular_cells();
  parallel_for_each(
      nodes_.cells.size(),
      [&](std::size_t c) {
        if (cell_bonds_[c].empty()) return;
        std::vector<const FacePoint*> points;
        for (const std::uint32_t at : cell_bonds_[c])
          for (const FacePoint& point : bonds_[at / 2].points[at % 2]) points.push_back(&point);
        std::array<Vec3, kQuadraticNodes> rest;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n) rest[n] = nodes_.rest[nodes_.of_cell[c][n]];
        bearing_limit_[c] = bearing_limit(elastic.matrix(c), rest, points, lattice(c), moduli_[part_[c]]);
      },
      kIntegratedCellsAtATime);
}

void NodalLoad::add_to(const std::vector<Vec3>& displacement, double share, std::vector<Vec3>& sum) const {
  if (follower) return follower->add_forces(displacement, share, sum);
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += share * forces[n];
}

bool QuadraticSystem::follows() const {
  return std::any_of(loads_.begin(), loads_.end(),
                     [](const NodalLoad& load) { return load.follower != nullptr; });
}

bool QuadraticSystem::links_follow() const {
  return std::any_of(linked_.begin(), linked_.end(),
                     [](const NitscheSupport* support) { return support->tie->motion.link->follower; });
}

void QuadraticSystem::place_loads(const std::vector<Load>& loads) {
  for (const Load& load : loads) {
    const Selected selected = loaded_by(load, problem_.body);
    if (!selected.elements.empty()) {
      loads_.push_back(load_on_elements(load, selected.elements));
      continue;
    }
    NodalLoad made{load.name, std::vector<Vec3>(nodes_.size(), Vec3::Zero()),
                   load.torque.has_value() || load.at.has_value()};
    const std::vector<FacePoint> points = face_points(problem_, nodes_, selected.polygons, box());
    if (points.empty() && cut_.surroundings == nullptr)
      throw InputError(
          load.origin,
          fmt::format("load \"{}\": no matter lies under the selected surface; use a smaller spacing, or "
                      "another face where this one is of a crumb that hangs on nothing",
                      load.name));
    if (cut_.surroundings == nullptr) check_area(load, selected.polygons, points);
    for (const std::uint32_t p : selected.polygons) pressure_[p] += load.pressure.value_or(kUnknownPressure);
    std::vector<LoadedPoint> loaded;
    const std::vector<Vec3> forces =
        forces_at(load, cut_.surroundings == nullptr ? points : all_points(selected.polygons), loaded);
    for (std::size_t q = 0; q < points.size(); ++q) {
      const QuadraticShape shape = quadratic_shape(points[q].at);
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        made.forces[nodes_.of_cell[points[q].cell][n]] += shape.value[n] * forces[q];
    }
    if (load.follower) made.follower = follower(load, points, loaded);
    loads_.push_back(std::move(made));
  }
}

NodalLoad QuadraticSystem::load_on_elements(const Load& load,
                                            const std::vector<std::uint32_t>& elements) const {
  require_load_on_elements(load);
  const std::vector<MatterPoint> points = matter_points(
      problem_.body, nodes_, elements, [&](std::size_t c) { return moments(c); },
      [&](std::size_t c) -> const Lattice& { return lattice(c); });
  if (points.empty()) fail_without_matter(load);
  NodalLoad made{load.name, std::vector<Vec3>(nodes_.size(), Vec3::Zero()),
                 load.torque.has_value() || load.at.has_value()};
  made.on_elements = true;
  std::vector<LoadedPoint> loaded;
  for (const MatterPoint& each : points) loaded.push_back(each.point);
  const std::vector<Vec3> forces = load_forces(load, loaded);
  for (std::size_t q = 0; q < points.size(); ++q)
    for (const auto& [node, share] : points[q].carriers) made.forces[node] += share * forces[q];
  if (load.follower)
    made.follower = turning_load(load, loaded, [&](std::size_t q, const auto& each) {
      for (const auto& [node, share] : points[q].carriers) each(node, share);
    });
  return made;
}

// N, at each of the points that the load acts on.
std::vector<Vec3> QuadraticSystem::forces_at(const Load& load, const std::vector<FacePoint>& points,
                                             std::vector<LoadedPoint>& loaded) const {
  std::vector<Vec3> forces;
  for (const FacePoint& point : points) {
    if (load.pressure)
      forces.push_back(-*load.pressure * point.area_vector);
    else
      loaded.push_back({point.position, point.area_vector.norm(), point.area_vector.normalized()});
  }
  return load.pressure ? forces : load_forces(load, loaded);
}

// Its own first.
std::vector<FacePoint> QuadraticSystem::all_points(const std::vector<std::uint32_t>& polygons) const {
  std::vector<FacePoint> points = face_points(problem_, nodes_, polygons, box());
  if (cut_.surroundings == nullptr) return points;
  const std::vector<FacePoint> beyond = cut_.surroundings->beyond(polygons);
  points.insert(points.end(), beyond.begin(), beyond.end());
  return points;
}

std::unique_ptr<FollowerLoad> QuadraticSystem::follower(const Load& load,
                                                        const std::vector<FacePoint>& points,
                                                        const std::vector<LoadedPoint>& loaded) const {
  if (!load.pressure)
    return turning_load(load, loaded, [&](std::size_t q, const auto& each) {
      const QuadraticShape shape = quadratic_shape(points[q].at);
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        each(nodes_.of_cell[points[q].cell][n], shape.value[n]);
    });
  auto made = std::make_unique<PressingLoad>(*load.pressure);
  for (const FacePoint& point : points) {
    const QuadraticShape shape = world_shape(lattice(point.cell), point.at);
    made->add_point(nodes_.of_cell[point.cell], shape.value, shape.gradient, point.area_vector);
  }
  return made;
}

void QuadraticSystem::check_area(const Load& load, const std::vector<std::uint32_t>& polygons,
                                 const std::vector<FacePoint>& points) {
  constexpr double kLost = 0.01;
  double whole = 0, found = 0;
  for (const std::uint32_t p : polygons)
    whole += area_vector(problem_.body.surface.vertices, problem_.body.surface.polygon(p)).norm();
  for (const FacePoint& point : points) found += point.area_vector.norm();
  if (found < (1 - kLost) * whole)
    warnings_.push_back(
        fmt::format("load \"{}\": {} of its surface lies on matter that the lattice leaves out; "
                    "use a smaller spacing",
                    load.name, human_share(1 - found / whole)));
}

void QuadraticSystem::add_gravity(const Vec3& acceleration) {
  NodalLoad made{"gravity", std::vector<Vec3>(nodes_.size(), Vec3::Zero())};
  for (std::size_t c = 0; c < nodes_.cells.size(); ++c) {
    const auto volumes = shape_integrals(lattice(c).spacing.prod(), moments(c));
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      made.forces[nodes_.of_cell[c][n]] += problem_.materials[part_[c]].density * volumes[n] * acceleration;
  }
  loads_.push_back(std::move(made));
}

bool QuadraticSystem::is_whole(std::size_t cell) const {
  return moments_at_[cell] == kWhole;
}

Moments QuadraticSystem::moments(std::size_t cell) const {
  return moments_at_[cell] == kWhole ? whole_cell_moments() : body_moments(problem_.body, moments_at_[cell]);
}

Moments QuadraticSystem::stiffness_moments(std::size_t cell) const {
  if (moments_at_[cell] == kWhole) return whole_cell_moments();
  const Moments own = moments(cell);
  return own + kOutside * (whole_cell_moments() - own);
}

Vec3 QuadraticSystem::middle(std::size_t cell) const {
  return middle_of(moments(cell)).cwiseMax(0).cwiseMin(1);
}

CellMatrix QuadraticSystem::support_stiffness(std::size_t cell, double safety, const Mat3& rotation) const {
  CellMatrix matrix = CellMatrix::Zero();
  for (const SupportIntegrals& each : cell_supports_[cell])
    each.add_to(penalty(cell, safety), rotation, matrix);
  for (const std::uint32_t at : cell_bonds_[cell]) add_own_stiffness(bond(at / 2, safety), at % 2, matrix);
  return matrix;
}

BondSides QuadraticSystem::bond(std::size_t pair, double safety) const {
  BondSides made;
  made.pair = &bonds_[pair];
  std::array<double, 2> limit{};
  for (std::size_t side = 0; side < 2; ++side) {
    const std::uint32_t cell = bonds_[pair].cell[side];
    made.lattice[side] = &lattice(cell);
    made.moduli[side] = &moduli_[part_[cell]];
    limit[side] = bearing_limit_[cell];
  }
  const double sum = limit[0] + limit[1];
  made.weight = {limit[1] / sum, limit[0] / sum};
  made.penalty = safety * kBondNitsche * limit[0] * made.weight[0];
  // beside a rigid part the traction is that of the other
  for (std::size_t side = 0; side < 2 && !rigidity_.empty(); ++side)
    if (rigidity_[part_[bonds_[pair].cell[side]]] != Rigidity::none) {
      made.weight[side] = 0;
      made.weight[1 - side] = 1;
      made.penalty = safety * kBondNitsche * limit[1 - side];
    }
  return made;
}

std::shared_ptr<const CellCouplings> QuadraticSystem::couplings(
    double safety, const std::function<Mat3(std::size_t)>& rotation) const {
  if (bonds_.empty()) return nullptr;
  std::vector<std::array<std::uint32_t, 2>> pairs;
  for (const BondedCells& each : bonds_) pairs.push_back(each.cell);
  auto made = std::make_shared<CellCouplings>(std::move(pairs), nodes_.cells.size());
  parallel_for_each(
      bonds_.size(),
      [&](std::size_t p) {
        made->cross[p] =
            cross_stiffness(bond(p, safety), {rotation(bonds_[p].cell[0]), rotation(bonds_[p].cell[1])});
      },
      kIntegratedCellsAtATime);
  return made;
}

std::vector<std::vector<std::uint32_t>> QuadraticSystem::bonded_elements() const {
  std::vector<std::vector<std::uint32_t>> found;
  for (const BondedCells& each : bonds_) {
    std::vector<std::uint32_t>& elements = found.emplace_back();
    for (const std::uint32_t cell : each.cell) {
      const auto& own = problem_.body.cell_elements[nodes_.cells[cell]];
      elements.insert(elements.end(), own.begin(), own.end());
    }
    std::sort(elements.begin(), elements.end());
  }
  return found;
}

double QuadraticSystem::penalty(std::size_t cell, double safety) const {
  return safety * kNitsche * stiffest_[part_[cell]] / lattice(cell).spacing.minCoeff();
}

NitschePoint QuadraticSystem::point(const NitscheSupport& support, const FacePoint& at, double safety,
                                    double share) const {
  NitschePoint made = nitsche_point(at, *support.tie, share, lattice(at.cell), moduli_[part_[at.cell]],
                                    penalty(at.cell, safety));
  if (heated())
    made.free = stress_of(moduli_[part_[at.cell]], free_strain(at.cell, at.at)) * at.area_vector.normalized();
  return made;
}

// int B^T A : e dV with the weights of the stiffness, so that a strain that the cells can have leaves no force; and the traction
// of the free strain on supports.
void QuadraticSystem::integrate_free_strain() {
  free_forces_.assign(nodes_.cells.size() * kCellUnknowns, 0);
  parallel_for_each(
      nodes_.cells.size(),
      [&](std::size_t c) {
        const Moments weights = stiffness_moments(c);
        const double volume = lattice(c).spacing.prod();
        for (std::size_t k = 0; k < kMoments; ++k) {
          const Vec3 at = gauss_point(k);
          const Mat3 stress = volume * weights[static_cast<Eigen::Index>(k)] *
                              stress_of(moduli_[part_[c]], free_strain(c, at));
          const QuadraticShape shape = world_shape(lattice(c), at);
          for (std::size_t n = 0; n < kQuadraticNodes; ++n)
            Eigen::Map<Vec3>(&free_forces_[c * kCellUnknowns + 3 * n]) += stress * shape.gradient[n];
        }
        for (SupportIntegrals& held : cell_supports_[c])
          for (const FacePoint* point : held.points) {
            const Vec3 traction =
                stress_of(moduli_[part_[c]], free_strain(c, point->at)) * point->area_vector;
            const QuadraticShape shape = quadratic_shape(point->at);
            for (std::size_t n = 0; n < kQuadraticNodes; ++n) held.free[n] += shape.value[n] * traction;
          }
      },
      kIntegratedCellsAtATime);
  free_force_ = norm_of_free_forces();
}

double QuadraticSystem::norm_of_free_forces() const {
  std::vector<Vec3> sum(nodes_.size(), Vec3::Zero());
  for (std::size_t c = 0; c < nodes_.cells.size(); ++c)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      sum[nodes_.of_cell[c][n]] += Eigen::Map<const Vec3>(&free_forces_[c * kCellUnknowns + 3 * n]);
  double squared = 0;
  for (const Vec3& each : sum) squared += each.squaredNorm();
  return std::sqrt(squared);
}

std::vector<Vec3> QuadraticSystem::free_shape() const {
  std::vector<Vec3> shape = prescribed();
  const std::vector<std::uint8_t> held = this->held();
  struct Of {
    Mat3 strain = Mat3::Zero();
    double volume = 0;
    std::optional<Vec3> about;
  };
  std::vector<Of> parts(moduli_.size());
  for (std::size_t c = 0; c < nodes_.cells.size(); ++c) {
    Of& part = parts[part_[c]];
    const double volume = problem_.body.fill[nodes_.cells[c]];
    part.strain += volume * free_strain(c, middle(c));
    part.volume += volume;
    for (std::size_t n = 0; n < kQuadraticNodes && !part.about; ++n)
      if (held[nodes_.of_cell[c][n]] == 7) part.about = nodes_.rest[nodes_.of_cell[c][n]];
  }
  for (std::size_t c = 0; c < nodes_.cells.size(); ++c) {
    const Of& part = parts[part_[c]];
    const Vec3 about = part.about.value_or(nodes_.rest[nodes_.of_cell[0][0]]);
    for (const std::uint32_t n : nodes_.of_cell[c]) {
      const Vec3 moved = part.strain / std::max(part.volume, 1e-300) * (nodes_.rest[n] - about);
      for (int axis = 0; axis < 3; ++axis)
        if (!(held[n] >> axis & 1)) shape[n][axis] = moved[axis];
    }
  }
  return shape;
}

std::vector<std::uint8_t> QuadraticSystem::held() const {
  std::vector<std::uint8_t> held(nodes_.size(), 0);
  for (const NitscheSupport& support : supports_)
    for (const std::uint32_t n : support.nodes)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (support.tie->axes[axis]) held[n] = static_cast<std::uint8_t>(held[n] | 1u << axis);
  for (const std::uint32_t n : cut_.nodes) held[n] = 7;
  return held;
}

CellProducts<double> QuadraticSystem::cells(
    const std::function<std::optional<Moments>(std::size_t)>& moments) const {
  std::vector<CellProducts<double>::PartCells> parts;
  for (std::size_t p = 0; p < moduli_.size(); ++p) {
    const Lattice& lattice = problem_.body.parts[p].lattice;
    parts.push_back({cell_elasticity(lattice, moduli_[p]), lattice.axes});
  }
  return {nodes_, parts, part_, moments};
}

CellProducts<double> QuadraticSystem::outside() const {
  const Moments whole = whole_cell_moments();
  return cells([&](std::size_t c) { return Moments(kOutside * (whole - moments(c))); });
}

CellProducts<double> QuadraticSystem::regular_cells() const {
  return cells([&](std::size_t c) -> std::optional<Moments> {
    if (moments_at_[c] == kWhole) return std::nullopt;
    return stiffness_moments(c);
  });
}

QuadraticOperator QuadraticSystem::stiffness(double safety) const {
  CellProducts<double> cells = regular_cells();
  std::vector<std::uint32_t> supported;
  for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c)
    if (is_supported(c)) supported.push_back(c);
  cells.reserve_supports(supported);
  parallel_for_each(
      supported.size(),
      [&](std::size_t i) {
        cells.set_support(supported[i], support_stiffness(supported[i], safety, Mat3::Identity()));
      },
      kIntegratedCellsAtATime);
  cells.set_couplings(couplings(safety, [](std::size_t) { return Mat3(Mat3::Identity()); }));
  return {nodes_, std::move(cells), held()};
}

std::vector<Vec3> QuadraticSystem::right_side(double safety) const {
  std::vector<Vec3> sum(nodes_.size(), Vec3::Zero());
  for (const NodalLoad& load : loads_)
    for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += load.forces[n];
  for (std::size_t c = 0; heated() && c < nodes_.cells.size(); ++c) {
    const std::span<const double> own = free_forces(c);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      Vec3 force = Eigen::Map<const Vec3>(&own[3 * n]);
      for (const SupportIntegrals& held : cell_supports_[c])
        force -= Vec3(held.support->tie->axes[0], held.support->tie->axes[1], held.support->tie->axes[2])
                     .cwiseProduct(held.free[n]);
      sum[nodes_.of_cell[c][n]] += force;
    }
  }
  for (const NitscheSupport& support : supports_) {
    if (!support.tie->is_move) continue;
    for (const FacePoint& at : support.points) {
      std::array<Vec3, kQuadraticNodes> forces;
      forces.fill(Vec3::Zero());
      add_led(point(support, at, safety), Mat3::Identity(), forces);
      for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum[nodes_.of_cell[at.cell][n]] += forces[n];
    }
  }
  return sum;
}

std::vector<Vec3> QuadraticSystem::prescribed(double share) const {
  std::vector<Vec3> value(nodes_.size(), Vec3::Zero());
  for (const NitscheSupport& support : supports_)
    for (const std::uint32_t n : support.nodes) {
      const Vec3 led = support.tie->motion.displacement(nodes_.rest[n], share);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (support.tie->axes[axis])
          value[n][static_cast<Eigen::Index>(axis)] = led[static_cast<Eigen::Index>(axis)];
    }
  for (std::size_t i = 0; i < cut_.nodes.size(); ++i) value[cut_.nodes[i]] = share * cut_.displacement[i];
  return value;
}

std::vector<std::uint8_t> QuadraticSystem::held_elements() const {
  std::vector<std::uint8_t> held(problem_.body.element_count(), 0);
  for (const NitscheSupport& support : supports_)
    for (const std::uint32_t node : support.nodes)
      if (node < nodes_.elements.size()) held[nodes_.elements[node]] = 1;
  return held;
}

std::vector<std::uint8_t> QuadraticSystem::tied_elements() const {
  std::vector<std::uint8_t> tied(problem_.body.element_count(), 0);
  const auto mark = [&](std::uint32_t node, const Tie& tie) {
    if (node >= nodes_.elements.size()) return;
    std::uint8_t& known = tied[nodes_.elements[node]];
    known = std::max<std::uint8_t>(known, tie.axes[0] && tie.axes[1] && tie.axes[2] ? 2 : 1);
  };
  for (const NitscheSupport& support : supports_) {
    for (const FacePoint& point : support.points)
      for (const std::uint32_t node : nodes_.of_cell[point.cell]) mark(node, *support.tie);
    for (const std::uint32_t node : support.nodes) mark(node, *support.tie);
  }
  return tied;
}

}  // namespace flexel::simulate
