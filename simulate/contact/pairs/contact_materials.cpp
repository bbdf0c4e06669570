// Foundations of two parts act as springs in series.
#include "simulate/contact/pairs/contact_materials.h"

#include <algorithm>
#include <limits>

#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kStiffness = 3;       // of a contact, in E / h an area
constexpr double kSoft = 0.01;         // of a spacing, over which pressure begins
constexpr double kFarthestSoft = 0.4;  // of a spacing, that an impact makes it at most
constexpr double kMostPullOff = 0.35;  // spacings, at most, of the extension at which adhesion ends

}  // namespace

ContactMaterials::ContactMaterials(const ContactSettings& settings, const Problem& problem,
                                   const ContactSurface& surface)
    : settings_(settings),
      surface_(surface),
      slides_(element_factors(problem.body, "friction_change")),
      stiffer_(problem.body, "stiffness_change") {
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    const Material& material = problem.materials[p];
    foundation_.push_back(kStiffness * settings.stiffness * material.young /
                          problem.body.parts[p].lattice.spacing.mean());
    friction_.push_back(material.contact_friction.value_or(settings.friction));
    stick_.push_back(settings.stick.empty() ? 0 : settings.stick[p]);
    rigid_.push_back(p < problem.rigidity.size() && problem.rigidity[p] != Rigidity::none);
  }
}

PairProperties ContactMaterials::between(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  // the faces beside an edge have all of the adhering area
  const bool edged = a.shape == ContactShape::edge || b.shape == ContactShape::edge;
  return {constants(i, j), 0.5 * (friction(i) + friction(j)),
          edged ? 0 : pull_off(i, 0.5 * (stick(i) + stick(j)), foundation(i, j)), kFarthestSoft * a.width};
}

PairProperties ContactMaterials::against_plane(std::uint32_t point, const ContactPlane& plane) const {
  const ContactPoint& at = surface_.points()[point];
  const double own = friction(point);
  const double traction =
      at.shape == ContactShape::edge ? 0 : 0.5 * (stick(point) + plane.stick.value_or(stick(point)));
  return {plane_constants(point), 0.5 * (own + plane.friction.value_or(own)),
          pull_off(point, traction, foundation(point)), kFarthestSoft * at.width};
}

bool ContactMaterials::dissipate() const {
  bool any = settings_.damping > 0 || surface_.body().element_columns.contains("stick_change");
  for (std::size_t p = 0; p < friction_.size(); ++p)
    any = any || (settings_.parts[p] && (friction_[p] > 0 || stick_[p] > 0));
  for (const ContactPlane& plane : settings_.planes)
    any = any || plane.friction.value_or(0) > 0 || plane.stick.value_or(0) > 0;
  return any;
}

// Pa/m
double ContactMaterials::foundation(std::uint32_t point) const {
  const ContactPoint& at = surface_.points()[point];
  return foundation_[at.part] * stiffer_.at(at.at);
}

// Pa/m: springs in series, scaled so that two equal parts have that of each; two balls have the mean, as in
// the paper (section 3.2), unless one is of a rigid part, whose own stiffness says nothing.
double ContactMaterials::foundation(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &from = surface_.points()[i], &to = surface_.points()[j];
  const double a = foundation(i), b = foundation(j);
  const bool balls = from.radius > 0 && to.radius > 0;
  return balls && !rigid_[from.part] && !rigid_[to.part] ? 0.5 * (a + b) : 2 * a * b / (a + b);
}

// mu of the part, times the factor of the elements that carry the point.
double ContactMaterials::friction(std::uint32_t point) const {
  const ContactPoint& at = surface_.points()[point];
  if (slides_.empty()) return friction_[at.part];
  double factor = 0;
  for (std::uint32_t a = 0; a < at.at.count; ++a) factor += at.at.weights[a] * slides_[at.at.elements[a]];
  return friction_[at.part] * std::max(factor, 0.0);
}

// Pa: that of the part and the changes by events, the elements' column "stick_change".
double ContactMaterials::stick(std::uint32_t point) const {
  const ContactPoint& at = surface_.points()[point];
  double stick = stick_[at.part];
  const auto& columns = surface_.body().element_columns;
  const auto column = columns.find("stick_change");
  if (column == columns.end() || column->second.components != 1) return stick;
  for (std::uint32_t a = 0; a < at.at.count; ++a)
    stick += at.at.weights[a] * column->second.values[at.at.elements[a]];
  return std::max(stick, 0.0);
}

// m: extension of a contact of stiffness `foundation` [Pa/m] under a traction of `stick` [Pa].
double ContactMaterials::pull_off(std::uint32_t i, double stick, double foundation) const {
  return stick > 0 ? std::min(stick / foundation, kMostPullOff * surface_.points()[i].width) : 0;
}

PairConstants ContactMaterials::constants(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  const bool balls = a.radius > 0 && b.radius > 0;
  PairConstants pair;
  pair.stiffness = foundation(i, j) * (balls ? 0.5 * (a.area + b.area) : a.area * b.area);
  pair.width = balls ? 0 : std::max(a.width, b.width);
  pair.facing_from = std::min(a.facing_from, b.facing_from);
  pair.facing_fully = std::min(a.facing_fully, b.facing_fully);
  pair.limit = a.depth + b.depth;
  pair.law = {kSoft * std::min(a.width, b.width), 0.25 * pair.limit};
  return pair;
}

PairConstants ContactMaterials::plane_constants(std::uint32_t i) const {
  const ContactPoint& point = surface_.points()[i];
  PairConstants pair;
  pair.stiffness = foundation(i) * point.area;
  pair.facing_from = point.facing_from;
  pair.facing_fully = point.facing_fully;
  pair.limit = std::numeric_limits<double>::infinity();
  pair.law = {kSoft * point.width, 0.5 * point.depth};
  return pair;
}

}  // namespace flexel::simulate
