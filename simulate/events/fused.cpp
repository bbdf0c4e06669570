// Points are few beside the lattice: one after the other.
#include "simulate/events/fused.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/error.h"
#include "simulate/models/central_spring.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

// sum w x [m]. The weights' sum is 0: from one of the elements, so that rounding is that of the distances between them.
Vec3 gap_of(const Body& body, const FusedPoint& point, const State& state) {
  Vec3 rest = Vec3::Zero(), moved = Vec3::Zero();
  for (std::size_t i = 1; i < point.elements.size(); ++i) {
    const std::uint32_t own = point.elements[i], first = point.elements[0];
    rest += point.weights[i] * (body.rest[own] - body.rest[first]);
    moved += point.weights[i] * (state.displacement[own] - state.displacement[first]);
  }
  return rest + moved;
}

bool is_connection(const FusedPoint& point) {
  return point.length > 0 && point.elements.size() == 2;
}

// (elements) What parts have, times the factor of the elements' column; empty: no part has any.
std::vector<double> of_elements(const Body& body, const std::vector<double>& of_parts, const char* column) {
  if (std::all_of(of_parts.begin(), of_parts.end(), [](double each) { return each == 0; })) return {};
  std::vector<double> values;
  const std::vector<double> factors = element_factors(body, column);
  for (std::size_t p = 0; p < body.parts.size(); ++p)
    for (std::uint32_t e = body.parts[p].element_begin; e < body.parts[p].element_end; ++e)
      values.push_back(of_parts[p] * (factors.empty() ? 1 : factors[e]));
  return values;
}

// (points) The means; empty where `values` (elements) are.
std::vector<double> means(const std::vector<FusedPoint>& points, const std::vector<double>& values,
                          double none) {
  std::vector<double> result;
  if (values.empty()) return result;
  for (const FusedPoint& point : points)
    result.push_back(is_connection(point) ? 0.5 * (values[point.elements[0]] + values[point.elements[1]])
                                          : none);
  return result;
}

}  // namespace

FusedConnections fused_connections(const Body& body, std::vector<FusedPoint> points,
                                   const KernelEffects& plan, const std::vector<double>& friction) {
  FusedConnections made;
  made.points = std::move(points);
  made.damping = means(made.points, of_elements(body, plan.damping, "damping_change"), 0);
  made.friction = means(made.points, of_elements(body, friction, "friction_change"), 0);
  if (plan.fracture.empty()) return made;
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> elongation;
  for (const FractureLimits& limits : plan.fracture) elongation.push_back(limits.elongation);
  made.elongation = means(made.points, of_elements(body, elongation, "strength_change"), kNever);
  made.broken.assign(made.points.size(), 0);
  return made;
}

FusedPoints::FusedPoints(const Body& body, std::vector<FusedPoint> points)
    : body_(&body), fused_(std::make_shared<FusedConnections>()) {
  fused_->points = std::move(points);
}

std::string FusedPoints::why() const {
  return fmt::format("{} points fused by events", fused_->points.size());
}

double FusedPoints::energy(const State& state) {
  double energy = 0;
  for (std::size_t p = 0; p < fused_->points.size(); ++p) {
    const FusedPoint& point = fused_->points[p];
    if (fused_->is_broken(p)) continue;
    const double off = gap_of(*body_, point, state).norm() - point.length;
    energy += 0.5 * point.stiffness * off * off;
  }
  return energy;
}

void FusedPoints::add_forces(const State& state, std::vector<Vec3>& forces) {
  for (std::size_t p = 0; p < fused_->points.size(); ++p) {
    const FusedPoint& point = fused_->points[p];
    if (fused_->is_broken(p)) continue;
    const Vec3 apart = gap_of(*body_, point, state);
    Vec3 pull = -point.stiffness * apart;
    if (point.length > 0) pull *= 1 - point.length / apart.norm();
    for (std::size_t i = 0; i < point.elements.size(); ++i)
      forces[point.elements[i]] += point.weights[i] * pull;
  }
}

void FusedPoints::add_stiffness(const State& state, BlockMatrix& matrix) {
  for (const FusedPoint& point : fused_->points) {
    Block block = point.stiffness * Block::Identity();
    if (point.length > 0) {
      const Vec3 apart = gap_of(*body_, point, state);
      const double length = apart.norm();
      block = spring_tangent(point.stiffness, {apart / length, length, length - point.length}, true);
    }
    for (std::size_t i = 0; i < point.elements.size(); ++i)
      for (std::size_t j = 0; j < point.elements.size(); ++j)
        matrix.values[position_of(matrix, point.elements[i], point.elements[j])] +=
            point.weights[i] * point.weights[j] * block;
  }
}

std::vector<CoupledElements> FusedPoints::couples() const {
  std::vector<CoupledElements> groups;
  for (const FusedPoint& point : fused_->points) {
    groups.push_back(point.elements);
    std::sort(groups.back().begin(), groups.back().end());
  }
  return groups;
}

// Gershgorin on the rows of k w w^T.
double FusedPoints::added_frequency(const State&, const std::vector<double>& mass) {
  if (added_frequency_) return *added_frequency_;
  std::map<std::uint32_t, double> row;
  for (const FusedPoint& point : fused_->points) {
    double all = 0;
    for (const double weight : point.weights) all += std::abs(weight);
    for (std::size_t i = 0; i < point.elements.size(); ++i)
      row[point.elements[i]] += point.stiffness * std::abs(point.weights[i]) * all;
  }
  double largest = 0;
  for (const auto& [e, sum] : row) largest = std::max(largest, sum / mass[e]);
  added_frequency_ = largest;
  return largest;
}

std::vector<double> FusedPoints::memory() const {
  return {fused_->broken.begin(), fused_->broken.end()};
}

void FusedPoints::restore(const std::vector<double>& memory) {
  if (memory.size() != fused_->broken.size())
    throw InputError("the checkpoint's fused points are not those of its body");
  std::transform(memory.begin(), memory.end(), fused_->broken.begin(),
                 [](double each) { return static_cast<std::uint8_t>(each != 0); });
}

// The energy is that of half a step before: what the leapfrog loses when a force is taken away.
ConnectionLosses FusedPoints::tear(const State& state) {
  ConnectionLosses losses;
  for (std::size_t p = 0; p < fused_->elongation.size(); ++p) {
    const FusedPoint& point = fused_->points[p];
    if (fused_->is_broken(p) || !is_connection(point)) continue;
    const Vec3 apart = gap_of(*body_, point, state);
    const double length = apart.norm(), elongation = length - point.length;
    if (!(length > point.length * (1 + fused_->elongation[p]))) continue;
    fused_->broken[p] = 1;
    const Vec3 velocity = state.velocity[point.elements[0]] - state.velocity[point.elements[1]];
    const double rate = point.weights[0] * apart.dot(velocity) / length;
    ++losses.broken;
    losses.released += 0.5 * point.stiffness * elongation * (elongation - state.kick * rate);
  }
  return losses;
}

std::vector<FusedPoint> FusedPoints::left() const {
  std::vector<FusedPoint> whole;
  for (std::size_t p = 0; p < fused_->points.size(); ++p)
    if (!fused_->is_broken(p)) whole.push_back(fused_->points[p]);
  return whole;
}

// Of the first element to the second.
struct FusedLosses::Passing {
  Stretch now;
  Vec3 sliding = Vec3::Zero();     // m/s, across the connection
  double rate = 0, stiffness = 0;  // m/s, along it; N/m, 0: broken or no connection
};

FusedLosses::Passing FusedLosses::passing(std::size_t p, const State& state) const {
  const FusedPoint& point = fused_->points[p];
  Passing found;
  if (!is_connection(point) || fused_->is_broken(p)) return found;
  const std::uint32_t a = point.elements[0], b = point.elements[1];
  const Vec3 apart = (body_->rest[b] - body_->rest[a]) + (state.displacement[b] - state.displacement[a]);
  const double length = apart.norm();
  found.now = {apart / length, length, length - point.length};
  const Vec3 velocity = state.velocity[b] - state.velocity[a];
  found.rate = velocity.dot(found.now.direction);
  found.sliding = velocity - found.rate * found.now.direction;
  found.stiffness = point.stiffness;
  return found;
}

std::optional<FusedLosses> FusedLosses::make(const Body& body, std::shared_ptr<FusedConnections> fused,
                                             const std::vector<double>& mass) {
  const auto any = [](const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double each) { return each > 0; });
  };
  if (!any(fused->damping) && !any(fused->friction)) return std::nullopt;
  std::map<std::uint32_t, int> connections;
  for (const FusedPoint& point : fused->points)
    if (is_connection(point))
      for (const std::uint32_t e : point.elements) ++connections[e];
  FusedLosses made;
  for (const FusedPoint& point : fused->points) {
    made.most_.push_back(0);
    if (!is_connection(point)) continue;
    const std::uint32_t a = point.elements[0], b = point.elements[1];
    made.most_.back() = mass[a] * mass[b] / (mass[a] + mass[b]) / std::max(connections[a], connections[b]);
  }
  made.body_ = &body;
  made.fused_ = std::move(fused);
  return made;
}

std::string FusedLosses::why() const {
  return "damping and friction of connections that were fused";
}

double FusedLosses::resistance(const State& state) {
  double power = 0;
  for (std::size_t p = 0; p < fused_->damping.size(); ++p) {
    const Passing found = passing(p, state);
    power += 0.5 * fused_->damping[p] * found.stiffness * found.rate * found.rate;
  }
  return power;
}

void FusedLosses::add_forces(const State& state, std::vector<Vec3>& forces) {
  const double unbounded = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < fused_->points.size(); ++p) {
    const Passing found = passing(p, state);
    if (found.stiffness == 0) continue;
    const double stops = state.kick > 0 ? most_[p] / state.kick : unbounded;  // kg/s
    const double damping = fused_->damping.empty() ? 0 : fused_->damping[p] * found.stiffness;
    const double pull = found.rate * std::min(damping, stops);
    Vec3 force = pull * found.now.direction;
    const double speed = found.sliding.norm();
    if (!fused_->friction.empty() && state.kick > 0 && speed > 0) {
      const double normal = found.stiffness * found.now.elongation + pull;
      force += std::min(std::abs(fused_->friction[p] * normal) / speed, stops) * found.sliding;
    }
    forces[fused_->points[p].elements[0]] += force;
    forces[fused_->points[p].elements[1]] -= force;
  }
}

void FusedLosses::add_resistance(const State& state, double scale, BlockMatrix& matrix) {
  for (std::size_t p = 0; p < fused_->damping.size(); ++p) {
    const Passing found = passing(p, state);
    if (found.stiffness == 0) continue;
    const Block block = (scale * fused_->damping[p] * found.stiffness) * found.now.direction *
                        found.now.direction.transpose();
    const std::vector<std::uint32_t>& ends = fused_->points[p].elements;
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < 2; ++j)
        matrix.values[position_of(matrix, ends[i], ends[j])] += (i == j ? 1 : -1) * block;
  }
}

std::vector<CoupledElements> FusedLosses::couples() const {
  std::vector<CoupledElements> groups;
  for (const FusedPoint& point : fused_->points) {
    if (!is_connection(point)) continue;
    groups.push_back(point.elements);
    std::sort(groups.back().begin(), groups.back().end());
  }
  return groups;
}

}  // namespace flexel::simulate
