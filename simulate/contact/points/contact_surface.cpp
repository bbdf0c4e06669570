// Position by the weights of the carrying elements, normal by the cell's mean deformation gradient.
#include "simulate/contact/points/contact_surface.h"

#include <Eigen/LU>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "simulate/kernels/chunk_layout.h"
#include "simulate/matter/masses.h"
#include "simulate/models/cell_model.h"
#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kNoCarrier = 0xffffffff;
constexpr double kLeastVolume = 0.05;  // of a cell at rest, below which it gives no normal
constexpr double kLeastWeight = 1e-3;  // of a point on an element, that limits its area
constexpr double kMostStretch = 25;    // sum of squares of its stretches, above which it gives none

}  // namespace

ContactSurface::ContactSurface(const Problem& problem, const std::vector<std::uint8_t>& parts, int patches)
    : body_(problem.body), points_(contact_points(problem, parts, patches)), mass_(lumped_masses(problem)) {
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    std::array<Vec3, 8> gradients = cell_kind(body_.parts[p].lattice, problem.materials[p]).gradient;
    for (Vec3& each : gradients) each /= 4;
    gradients_.push_back(gradients);
  }
  rigid_.resize(body_.parts.size());
  const std::vector<MassMoments> moments = rigid_moments(problem);
  for (std::uint32_t p = 0; p < problem.rigidity.size(); ++p) {
    if (problem.rigidity[p] == Rigidity::none) continue;
    const RigidBody rigid = rigid_body(body_, p, moments[p]);
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(rigid.inverse_inertia, Eigen::EigenvaluesOnly);
    rigid_[p] = RigidPart{problem.rigidity[p] == Rigidity::free, rigid.centre, 1 / rigid.mass,
                          eigen.eigenvalues()[2]};
  }
  // Where an edge runs through a sliver of a cell, its elements are light: the area of a point there is at
  // most what a face's point on that mass would have.
  for (ContactPoint& point : points_)
    for (std::uint32_t a = 0; a < point.at.count && point.shape == ContactShape::edge; ++a)
      if (std::abs(point.at.weights[a]) > kLeastWeight)
        point.area = std::min(point.area, 0.5 * mass_[point.at.elements[a]] /
                                              (problem.materials[point.part].density * point.width *
                                               std::abs(point.at.weights[a])));
  std::vector<std::uint8_t> carries(body_.element_count(), 0);
  for (const ContactPoint& point : points_) {
    for (std::uint32_t a = 0; a < point.at.count; ++a) carries[point.at.elements[a]] = 1;
    widest_ = std::max(widest_, point.width);
    narrowest_ = std::min(narrowest_, point.width);
  }
  for (std::uint32_t e = 0; e < carries.size(); ++e)
    if (carries[e]) elements_.push_back(e);
  find_cells();
}

void ContactSurface::find_cells() {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < points_.size(); ++i)
    if (points_[i].at.count == 8) order.push_back(i);
  const auto less = [](const auto& a, const auto& b) { return a < b; };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return less(points_[a].at.elements, points_[b].at.elements);
  });
  cell_.assign(points_.size(), kNoCarrier);
  for (std::uint32_t c = 0; c < body_.cell_count() && !order.empty(); ++c) {
    const std::array<std::uint32_t, 8>& corners = body_.cell_elements[c];
    auto at = std::lower_bound(order.begin(), order.end(), corners, [&](std::uint32_t i, const auto& key) {
      return points_[i].at.elements < key;
    });
    if (at != order.end() && points_[*at].at.elements == corners) cells_.push_back(c);
    for (; at != order.end() && points_[*at].at.elements == corners; ++at) cell_[*at] = c;
  }
}

std::optional<std::uint32_t> ContactSurface::cell(std::uint32_t point) const {
  return cell_[point] != kNoCarrier ? std::optional(cell_[point]) : std::nullopt;
}

bool ContactSurface::broken(std::uint32_t point) const {
  return cell_[point] != kNoCarrier && body_.broken[cell_[point]] != 0;
}

std::size_t ContactSurface::broken_cells() const {
  return static_cast<std::size_t>(
      std::count_if(cells_.begin(), cells_.end(), [&](std::uint32_t c) { return body_.broken[c] != 0; }));
}

PointState ContactSurface::at(std::uint32_t point, const State& state) const {
  const ContactPoint& from = points_[point];
  Vec3 displacement = Vec3::Zero();
  for (std::uint32_t a = 0; a < from.at.count; ++a)
    displacement += from.at.weights[a] * state.displacement[from.at.elements[a]];
  Mat3 gradient = Mat3::Zero();
  if (from.at.count == 8)
    for (std::size_t a = 0; a < 8; ++a)
      gradient += state.displacement[from.at.elements[a]] * gradients_[from.part][a].transpose();
  return at(point, displacement, shape_at(point, gradient));
}

CellShape ContactSurface::shape_at(std::uint32_t point, const Mat3& gradient) const {
  const ContactPoint& from = points_[point];
  CellShape shape;
  if (from.shape == ContactShape::ball) return shape;
  const Mat3 f = Mat3::Identity() + gradient;
  // The remains of a broken cell may have any shape and direction: whole faces and planes touch its points as
  // they touch those of edges, from all sides.
  const double volume = f.determinant(), stretch = f.squaredNorm();
  shape.shapeless = broken(point) || !(volume > kLeastVolume && stretch < kMostStretch);
  if (!shape.shapeless) shape.inverse = f.inverse();
  if (shape.shapeless || volume < 3 * kLeastVolume || stretch > 0.5 * kMostStretch) {
    shape.normal_rate = std::numeric_limits<double>::infinity();
    return shape;
  }
  // a bound of the spectral norm (Golub and Van Loan, section 2.3.3)
  const Mat3 size = shape.inverse.cwiseAbs();
  shape.normal_rate = std::sqrt(size.colwise().sum().maxCoeff() * size.rowwise().sum().maxCoeff());
  return shape;
}

PointState ContactSurface::at(std::uint32_t point, const Vec3& displacement, const CellShape& shape) const {
  const ContactPoint& from = points_[point];
  PointState made;
  static_cast<CellShape&>(made) = shape;
  made.side.position = from.rest + displacement;
  made.side.radius = from.radius;
  if (from.shape == ContactShape::ball) return made;
  if (shape.shapeless) return made;
  made.side.own_plane = from.shape == ContactShape::face ? 1 : 0;
  made.side.normal = (shape.inverse.transpose() * from.normal).normalized();
  made.normal_rate = shape.normal_rate;
  return made;
}

}  // namespace flexel::simulate
