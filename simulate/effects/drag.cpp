// The surface is gathered once: the points of surface_points() that one cell carries on one polygon become
// one face, with their mean weights. Per step the faces' forces are found side by side and added in their
// order.
#include "simulate/effects/drag.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>

#include "base/parallel.h"
#include "simulate/matter/interface_points.h"
#include "simulate/matter/masses.h"
#include "simulate/matter/surface_points.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kMostOfStep = 0.2;  // of the velocity, that drag may take in one step

Mat3 cofactor(const Mat3& f) {
  Mat3 result;
  for (int j = 0; j < 3; ++j) result.col(j) = f.col((j + 1) % 3).cross(f.col((j + 2) % 3));
  return result;
}

}  // namespace

void Drag::parse(TableReader& scene, Parameters& parameters) {
  const SceneValue* table = scene.find("drag");
  if (!table) return;
  TableReader reader(*table, scene.file(), "[drag]");
  parameters.density =
      reader.to_quantity(reader.require("density", "\"1.2 kg/m3\""), Dimension::density, "density");
  parameters.coefficient = reader.number("coefficient").value_or(1);
  reader.finish();
  if (!(*parameters.density >= 0)) reader.fail("\"density\" in [drag] needs to be 0 or more");
  if (!(parameters.coefficient >= 0)) reader.fail("\"coefficient\" in [drag] needs to be 0 or more");
}

std::vector<Drag::Face> Drag::faces(const Problem& problem) {
  std::vector<std::uint32_t> polygons;
  for (std::uint32_t p = 0; p < problem.body.surface.polygon_count(); ++p)
    if (problem.body.parts[problem.body.surface.polygon_part(p)].placement == Placement::corner)
      polygons.push_back(p);
  const std::vector<SurfacePoint> points = surface_points(problem, polygons);
  std::vector<std::uint32_t> order(points.size());  // of numbers: a point has 160 bytes
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t p) { return std::tie(points[p].polygon, points[p].at.elements); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<Face> faces;
  for (std::size_t i = 0; i < order.size();) {
    Face face;
    face.elements = points[order[i]].at.elements;
    face.part = problem.body.surface.polygon_part(points[order[i]].polygon);
    double area = 0;
    std::size_t end = i;
    for (; end < order.size() && key(order[end]) == key(order[i]); ++end) {
      const SurfacePoint& point = points[order[end]];
      const double each = point.area_vector.norm();
      face.area += point.area_vector;
      area += each;
      for (std::size_t a = 0; a < 8; ++a) face.weights[a] += each * point.at.weights[a];
    }
    for (double& weight : face.weights) weight /= area;
    if (face.area.norm() > 0) faces.push_back(face);
    i = end;
  }
  return faces;
}

// Takes off what another part covers: of the faces in a cell the one that looks most the way of the contact.
void Drag::uncover(const Problem& problem, std::vector<Face>& faces) {
  const std::vector<TouchingPoint> touching = touching_points(problem);
  if (touching.empty()) return;
  std::multimap<std::array<std::uint32_t, 8>, std::size_t> of_cell;
  for (std::size_t f = 0; f < faces.size(); ++f) of_cell.emplace(faces[f].elements, f);
  for (const TouchingPoint& point : touching)
    for (const int side : {0, 1}) {
      const Vec3 normal = side == 0 ? point.normal : Vec3(-point.normal);
      double most = 0.7;  // cosine of 45 degrees
      Face* covered = nullptr;
      const auto [begin, end] = of_cell.equal_range(point.at[static_cast<std::size_t>(side)].elements);
      for (auto at = begin; at != end; ++at) {
        const double towards = faces[at->second].area.normalized().dot(normal);
        if (towards <= most) continue;
        most = towards;
        covered = &faces[at->second];
      }
      if (covered) covered->exposed = std::max(0.0, covered->exposed - point.area / covered->area.norm());
    }
  // what is left of a face that is covered wholly, to rounding and to the quadrature of the other side
  std::erase_if(faces, [](const Face& face) { return face.exposed < 1e-3; });
}

void Drag::weigh(const std::vector<double>& mass, std::vector<Face>& faces) {
  std::vector<double> surface(mass.size(), 0);
  const auto share = [](const Face& face, std::size_t a) { return std::max(0.0, face.weights[a]); };
  for (const Face& face : faces)
    for (std::size_t a = 0; a < 8; ++a) surface[face.elements[a]] += share(face, a) * face.area.norm();
  for (Face& face : faces) {
    face.surface_mass = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < 8; ++a)
      if (share(face, a) > 0)
        face.surface_mass = std::min(face.surface_mass, mass[face.elements[a]] / surface[face.elements[a]]);
  }
}

std::optional<Drag> Drag::make(const Parameters& parameters, const Problem& problem) {
  if (!parameters.density || *parameters.density == 0) return std::nullopt;
  Drag made;
  made.density_ = *parameters.density;
  made.coefficient_ = parameters.coefficient;
  const std::vector<double> mass = lumped_masses(problem);
  const std::vector<double> factor = element_factors(problem.body, "radius_change");
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    const Part& part = problem.body.parts[p];
    made.kinds_.push_back(cell_kind(part.lattice, problem.materials[p]));
    if (part.placement == Placement::corner) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      const double radius = 0.5 * part.lattice.spacing.mean() * (factor.empty() ? 1 : factor[e]);
      made.balls_.push_back({e, std::numbers::pi * radius * radius, mass[e]});
    }
  }
  made.faces_ = faces(problem);
  uncover(problem, made.faces_);
  weigh(mass, made.faces_);
  return made;
}

std::string Drag::why() const {
  std::string why = "[drag]";
  if (!faces_.empty()) why += fmt::format(", {} pieces of surface", faces_.size());
  if (!balls_.empty()) why += fmt::format(", {} elements", balls_.size());
  return why;
}

Drag::Front Drag::front(const Face& face, const State& state) const {
  CellVectors u;
  Vec3 velocity = Vec3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    u[a] = state.displacement[face.elements[a]];
    velocity += face.weights[a] * state.velocity[face.elements[a]];
  }
  const Vec3 now =
      cofactor(Mat3::Identity() + displacement_gradient(kinds_[face.part], u)) * (face.exposed * face.area);
  const double outward = velocity.dot(now) / now.norm();
  return {now, outward > 0 ? outward : 0};
}

Vec3 Drag::force(const Face& face, const State& state) const {
  const Front at = front(face, state);
  if (at.outward == 0) return Vec3::Zero();
  double resistance = 0.5 * density_ * coefficient_ * at.outward;  // Pa s/m
  if (state.kick > 0) resistance = std::min(resistance, kMostOfStep * face.surface_mass / state.kick);
  return -(resistance * at.outward) * at.area;
}

double Drag::resistance(const State& state) {
  return parallel_sum<double>(faces_.size(),
                              [&](std::size_t f) {
                                const Front at = front(faces_[f], state);
                                return density_ * coefficient_ / 6 * at.area.norm() * std::pow(at.outward, 3);
                              }) +
         parallel_sum<double>(balls_.size(), [&](std::size_t b) {
           return density_ / 3 * balls_[b].area * std::pow(state.velocity[balls_[b].element].norm(), 3);
         });
}

// Each piece's matrix g w w^T n n^T is at most its row sums on the diagonal, and the same for what moves as
// one; balls: rho A (|v| I + v v^T / |v|) is at most twice rho A |v| I.
void Drag::add_resistance(const State& state, double scale, BlockMatrix& matrix) {
  for (const Face& face : faces_) {
    const Front at = front(face, state);
    if (at.outward == 0) continue;
    const Block block =
        scale * density_ * coefficient_ * at.outward / at.area.norm() * at.area * at.area.transpose();
    double sum = 0;
    for (const double weight : face.weights) sum += std::abs(weight);
    for (std::size_t a = 0; a < 8; ++a)
      matrix.values[diagonal_position(matrix, face.elements[a])] += std::abs(face.weights[a]) * sum * block;
  }
  for (const Ball& ball : balls_)
    matrix.values[diagonal_position(matrix, ball.element)].diagonal().array() +=
        2 * scale * density_ * ball.area * state.velocity[ball.element].norm();
}

void Drag::add_forces(const State& state, std::vector<Vec3>& forces) {
  std::vector<Vec3> found(faces_.size());
  parallel_for_each(faces_.size(), [&](std::size_t f) { found[f] = force(faces_[f], state); });
  for (std::size_t f = 0; f < faces_.size(); ++f)
    for (std::size_t a = 0; a < 8; ++a) forces[faces_[f].elements[a]] += faces_[f].weights[a] * found[f];
  parallel_for_each(balls_.size(), [&](std::size_t b) {
    const Ball& ball = balls_[b];
    const Vec3& velocity = state.velocity[ball.element];
    double resistance = density_ * ball.area * velocity.norm();  // kg/s
    if (state.kick > 0) resistance = std::min(resistance, kMostOfStep * ball.mass / state.kick);
    forces[ball.element] -= resistance * velocity;
  });
}

}  // namespace flexel::simulate
