// Unknowns are temperatures above that of the first face, so that little cancels.
#include "simulate/conduction/conduction.h"

#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/human.h"
#include "base/math/area_vector.h"
#include "base/stop.h"
#include "formats/lattice/cell_moments.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/interface_points.h"
#include "simulate/models/cells.h"
#include "simulate/quadratic/cells/cell_integrals.h"
#include "simulate/quadratic/cells/face_points.h"
#include "simulate/thermal/thermal.h"

namespace flexel::simulate {
namespace {

constexpr double kPenalty = 150;  // of Nitsche's method, times k / h
constexpr double kOutside =
    1e-6;  // conductivity of what is not matter, of the material's: slivers stay regular
constexpr double kTolerance = 1e-11;
constexpr int kMostIterations = 20000;
constexpr double kIce = 273.15;  // K
// Heats sum to nothing but for what the equations are not solved to: as shares of the heats, and of the
// penalty's part of them, which cancels.
constexpr double kImbalance = 1e-3, kRounding = 1e-9;

using Matrix = Eigen::SparseMatrix<double>;
using Corners = std::array<double, 8>;

struct HeatThrough {
  double sum = 0;    // W, into the part
  double gauge = 0;  // W, of the terms that cancel in it
};

// Preconditioned conjugate gradients from 0: Eigen's own would hear no stop. False: not converged.
bool solve_heat(const Matrix& matrix, const Eigen::VectorXd& right, Eigen::VectorXd& x, Progress& progress) {
  x = Eigen::VectorXd::Zero(right.size());
  const double whole = right.norm();
  if (whole == 0) return true;
  const Eigen::IncompleteCholesky<double> preconditioner(matrix);
  if (preconditioner.info() != Eigen::Success) return false;
  Eigen::VectorXd residual = right, z = preconditioner.solve(residual), direction = z;
  double product = residual.dot(z);
  for (int i = 0; i < kMostIterations; ++i) {
    check_stop();
    const Eigen::VectorXd image = matrix * direction;
    const double curvature = direction.dot(image);
    if (!(curvature > 0)) return false;
    x += product / curvature * direction;
    residual -= product / curvature * image;
    const double left = residual.norm() / whole;
    if (left <= kTolerance) return x.allFinite();
    if (i % 50 == 0)
      progress.update(std::clamp(std::log(left) / std::log(kTolerance), 0.0, 1.0),
                      fmt::format("heat, iteration {}", i + 1));
    z = preconditioner.solve(residual);
    const double next = residual.dot(z);
    direction = z + next / product * direction;
    product = next;
  }
  return false;
}

// Trilinear shape functions and their gradients [1/m], world frame.
struct TrilinearShape {
  Corners value{};
  std::array<Vec3, 8> gradient{};
};

TrilinearShape shape_at(const Lattice& lattice, const Vec3& at) {
  TrilinearShape shape;
  for (std::uint32_t a = 0; a < 8; ++a) {
    Vec3 part, slope;
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = (a >> axis & 1u) != 0;
      part[axis] = upper ? at[axis] : 1 - at[axis];
      slope[axis] = upper ? 1 : -1;
    }
    shape.value[a] = part.prod();
    const Vec3 own(slope.x() * part.y() * part.z(), part.x() * slope.y() * part.z(),
                   part.x() * part.y() * slope.z());
    shape.gradient[a] = lattice.axes * own.cwiseQuotient(lattice.spacing);
  }
  return shape;
}

class Conduction {
 public:
  Conduction(const Body& body, const Scene& scene)
      : body_(body),
        scene_(scene),
        settings_(scene.get<Thermal>()),
        fragments_(find_fragments(body)),
        problem_{body, materials_of_parts(scene, body), stray_cells(fragments_),
                 models_of_parts(scene, body)},
        nodes_(quadratic_nodes(body, active_cells(problem_))),
        part_(cell_parts(body)),
        right_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(nodes_.elements.size()))) {
    for (const HeatFace& face : settings_.faces)
      if (face.kind == HeatFace::Kind::temperature || face.kind == HeatFace::Kind::convection) {
        zero_ = face.kind == HeatFace::Kind::temperature ? face.value : face.ambient;
        break;
      }
    find_conductivities();
    refuse_bonded();
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c) {
      check_stop();
      add_cell(c);
    }
    refuse_at_odds();
    for (const HeatFace& face : settings_.faces) add_face(face);
    refuse_undetermined();
  }

  // (elements) K.
  [[nodiscard]] std::vector<double> solve(Progress& progress) {
    const auto n = static_cast<Eigen::Index>(nodes_.elements.size());
    Matrix matrix(n, n);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    if (!solve_heat(matrix, right_, temperature_, progress))
      throw DivergedError(scene_.name + ": heat conduction did not converge; use a smaller --size");
    std::vector<double> all(body_.element_count(), zero_ + (n > 0 ? temperature_.mean() : 0));
    for (Eigen::Index i = 0; i < n; ++i)
      all[nodes_.elements[static_cast<std::size_t>(i)]] = zero_ + temperature_[i];
    return all;
  }

  // W, into the part through each face. Throws DivergedError: they do not sum to nothing.
  [[nodiscard]] std::vector<double> heat() const {
    std::vector<double> sums;
    double sum = 0, most = 0;
    for (const FaceOfCells& face : faces_) {
      const HeatThrough through = heat_through(face);
      sums.push_back(through.sum);
      sum += through.sum;
      most += kImbalance * std::abs(through.sum) + kRounding * through.gauge;
    }
    if (!(std::abs(sum) <= most))
      throw DivergedError(
          fmt::format("{}: heat conduction did not converge: {} W more go in than out; use a smaller --size",
                      scene_.name, human_number(sum, 4)));
    return sums;
  }

  // K, of the matter: at the faces, where a steady temperature has its extremes, and at the corners of whole cells.
  [[nodiscard]] std::pair<double, double> range() const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto add = [&](double value) {
      low = std::min(low, zero_ + value);
      high = std::max(high, zero_ + value);
    };
    for (const FaceOfCells& face : faces_)
      for (const FacePoint& point : face.points)
        add(temperature_at(point.cell, shape_at(lattice(point.cell), point.at)));
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c)
      for (std::size_t a = 0; a < 8 && body_.fill[nodes_.cells[c]] >= kWholeFill; ++a)
        add(temperature_[unknown(c, a)]);
    return {low, high};
  }

  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  [[nodiscard]] const std::string& face_name(std::size_t face) const { return faces_[face].face->name; }

 private:
  struct FaceOfCells {
    const HeatFace* face;
    std::vector<FacePoint> points;
    double value;  // K above zero_ (temperature, ambient); W/m^2
  };

  [[nodiscard]] const Lattice& lattice(std::uint32_t cell) const {
    return body_.parts[part_[nodes_.cells[cell]]].lattice;
  }
  [[nodiscard]] double conductivity(std::uint32_t cell) const {
    return conductivity_[part_[nodes_.cells[cell]]];
  }
  [[nodiscard]] double penalty(std::uint32_t cell) const {
    return kPenalty * conductivity(cell) / lattice(cell).spacing.minCoeff();
  }
  // Elements come first among the nodes.
  [[nodiscard]] int unknown(std::uint32_t cell, std::size_t corner) const {
    return static_cast<int>(nodes_.of_cell[cell][node_of_corner(corner)]);
  }

  // Above zero_.
  [[nodiscard]] double temperature_at(std::uint32_t cell, const TrilinearShape& shape) const {
    double here = 0;
    for (std::size_t a = 0; a < 8; ++a) here += shape.value[a] * temperature_[unknown(cell, a)];
    return here;
  }

  [[nodiscard]] HeatThrough heat_through(const FaceOfCells& face) const {
    HeatThrough through;
    for (const FacePoint& point : face.points) {
      const TrilinearShape shape = shape_at(lattice(point.cell), point.at);
      const double area = point.area_vector.norm(), here = temperature_at(point.cell, shape);
      if (face.face->kind == HeatFace::Kind::temperature) {
        double flow = 0;
        for (std::size_t a = 0; a < 8; ++a)
          flow += conductivity(point.cell) * shape.gradient[a].dot(point.area_vector) *
                  temperature_[unknown(point.cell, a)];
        const double beta = area * penalty(point.cell);
        through.sum += flow - beta * (here - face.value);
        through.gauge += beta * (std::abs(here) + std::abs(face.value));
      } else if (face.face->kind == HeatFace::Kind::convection) {
        through.sum += area * face.face->value * (face.value - here);
        through.gauge += area * face.face->value * (std::abs(here) + std::abs(face.value));
      } else {
        through.sum += area * face.value;
      }
    }
    return through;
  }

  // Bonds and fused points carry forces only. Parts that touch and are not bonded may mean to be insulated: a warning.
  void refuse_bonded() {
    if (!fused_points(body_).empty())
      throw InputError(
          scene_.name,
          "an event fused parts of the body, or brought them, and conduction passes no heat from "
          "one to the other: make them one part, or take temperatures from [thermal] column = "
          "\"NAME\"");
    if (body_.parts.size() < 2) return;
    const Bonds::Parameters& bonds = scene_.get<Bonds>();
    const std::vector<TouchingGap> named = Bonds::named_gaps(bonds, body_);
    for_each_touching_point(problem_, named, [&](const TouchingPoint& point) {
      const std::array pair{std::min(point.part[0], point.part[1]), std::max(point.part[0], point.part[1])};
      const std::string names =
          fmt::format("parts \"{}\" and \"{}\"", body_.parts[pair[0]].name, body_.parts[pair[1]].name);
      if (bonds.bond || std::any_of(named.begin(), named.end(),
                                    [&](const TouchingGap& each) { return each.parts == pair; }))
        throw InputError(scene_.name,
                         names +
                             " are bonded, and conduction passes no heat from part to part: make them "
                             "one part, or take temperatures from [thermal] column = \"NAME\"");
      if (warnings_.empty()) warnings_.push_back(names + " touch, and parts pass no heat to each other");
    });
  }

  // A place has one temperature, and heat that comes in there goes straight out.
  void refuse_at_odds() {
    held_.assign(body_.surface.polygon_count(), nullptr);
    for (const HeatFace& face : settings_.faces) {
      if (face.kind != HeatFace::Kind::temperature) continue;
      for (const std::uint32_t p : resolve(face.where, body_).polygons) {
        if (held_[p] != nullptr && held_[p]->value != face.value)
          throw InputError(face.origin,
                           fmt::format("\"{}\" and \"{}\" ({}) give the same place two temperatures",
                                       face.name, held_[p]->name, held_[p]->origin));
        held_[p] = &face;
      }
    }
    for (const HeatFace& face : settings_.faces) {
      if (face.kind == HeatFace::Kind::temperature) continue;
      const std::vector<std::uint32_t> polygons = resolve(face.where, body_).polygons;
      if (!polygons.empty() &&
          std::all_of(polygons.begin(), polygons.end(), [&](std::uint32_t p) { return held_[p] != nullptr; }))
        throw InputError(face.origin,
                         fmt::format("\"{}\" does nothing: [[temperature]] \"{}\" ({}) holds the place where "
                                     "heat comes in; select another face",
                                     face.name, held_[polygons[0]]->name, held_[polygons[0]]->origin));
    }
  }

  void find_conductivities() {
    for (std::size_t p = 0; p < body_.parts.size(); ++p) {
      if (body_.parts[p].placement == Placement::centre)
        throw InputError(settings_.faces[0].origin, "conduction needs elements at the corners of the voxels");
      const ThermalFigures figures = thermal_figures(settings_, problem_.materials[p]);
      if (!figures.conductivity)
        throw InputError(
            settings_.faces[0].origin,
            fmt::format("part \"{}\": {} has no conductivity: write [materials.NAME] conductivity = "
                        "\"50 W/(m K)\"",
                        body_.parts[p].name, problem_.materials[p].name));
      conductivity_.push_back(*figures.conductivity);
    }
  }

  // Weights of Gauss's points, in units of the voxel's volume.
  [[nodiscard]] Moments weights(std::uint32_t cell) const {
    const std::uint32_t c = nodes_.cells[cell];
    const Moments whole = whole_cell_moments();
    const auto found = std::lower_bound(body_.moment_cells.begin(), body_.moment_cells.end(), c);
    if (found == body_.moment_cells.end() || *found != c) return std::min(body_.fill[c], 1.0) * whole;
    const auto place = static_cast<std::size_t>(found - body_.moment_cells.begin());
    const Moments own = Eigen::Map<const Moments>(&body_.moments[place * kMoments]);
    return own + kOutside * (whole - own);
  }

  void add(std::uint32_t cell, std::size_t a, std::size_t b, double value) {
    entries_.emplace_back(unknown(cell, a), unknown(cell, b), value);
  }

  void add_cell(std::uint32_t cell) {
    const Moments w = weights(cell);
    const double scale = conductivity(cell) * lattice(cell).spacing.prod();
    Eigen::Matrix<double, 8, 8> sum = Eigen::Matrix<double, 8, 8>::Zero();
    for (std::size_t k = 0; k < kMoments; ++k) {
      const TrilinearShape shape = shape_at(lattice(cell), gauss_point(k));
      Eigen::Matrix<double, 3, 8> g;
      for (std::size_t a = 0; a < 8; ++a) g.col(static_cast<Eigen::Index>(a)) = shape.gradient[a];
      sum.noalias() += scale * w[static_cast<Eigen::Index>(k)] * (g.transpose() * g);
    }
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        add(cell, a, b, sum(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)));
  }

  void add_face(const HeatFace& face) {
    const Selected selected = resolve(face.where, body_);
    if (selected.polygons.empty())
      throw InputError(face.origin,
                       fmt::format("\"{}\": heat goes through faces, groups and sides; {} selects none",
                                   face.name, describe(face.where)));
    FaceOfCells made{
        &face, in_firm_cells(body_, nodes_, face_points(problem_, nodes_, left_to(face, selected.polygons))),
        0};
    double area = 0;
    for (const FacePoint& point : made.points) area += point.area_vector.norm();
    if (!(area > 0))
      throw InputError(face.origin,
                       fmt::format("\"{}\": no matter lies under the selected surface; use a smaller "
                                   "spacing",
                                   face.name));
    made.value = face.kind == HeatFace::Kind::temperature  ? face.value - zero_
                 : face.kind == HeatFace::Kind::convection ? face.ambient - zero_
                 : face.kind == HeatFace::Kind::power      ? face.value / area
                                                           : face.value;
    for (const FacePoint& point : made.points) add_point(made, point);
    faces_.push_back(std::move(made));
  }

  // The polygons where a heat or a convection acts: where a temperature is given, what came in would go straight out.
  [[nodiscard]] std::vector<std::uint32_t> left_to(const HeatFace& face,
                                                   const std::vector<std::uint32_t>& polygons) {
    if (face.kind == HeatFace::Kind::temperature) return polygons;
    std::vector<std::uint32_t> left;
    double whole = 0, lost = 0;
    const HeatFace* by = nullptr;
    for (const std::uint32_t p : polygons) {
      const double area = area_vector(body_.surface.vertices, body_.surface.polygon(p)).norm();
      whole += area;
      if (held_[p] == nullptr) {
        left.push_back(p);
        continue;
      }
      lost += area;
      by = held_[p];
    }
    if (by != nullptr && face.kind != HeatFace::Kind::convection)
      warnings_.push_back(
          fmt::format("\"{}\" acts on {} of its area only: the rest has the temperature of \"{}\" ({}), and "
                      "heat that came in there "
                      "would go straight out{}",
                      face.name, human_share(1 - lost / whole), by->name, by->origin,
                      face.kind == HeatFace::Kind::power ? "; its power is that of what is left" : ""));
    return left;
  }

  void add_point(const FaceOfCells& face, const FacePoint& point) {
    const TrilinearShape shape = shape_at(lattice(point.cell), point.at);
    const double area = point.area_vector.norm();
    const bool fixed = face.face->kind == HeatFace::Kind::temperature;
    const bool convects = face.face->kind == HeatFace::Kind::convection;
    Corners flow{};
    if (fixed)
      for (std::size_t a = 0; a < 8; ++a)
        flow[a] = conductivity(point.cell) * shape.gradient[a].dot(point.area_vector) / area;
    const double beta = fixed ? penalty(point.cell) : convects ? face.face->value : 0;
    for (std::size_t a = 0; a < 8; ++a) {
      right_[unknown(point.cell, a)] +=
          area * face.value * (fixed || convects ? beta * shape.value[a] - flow[a] : shape.value[a]);
      for (std::size_t b = 0; b < 8 && beta > 0; ++b)
        add(point.cell, a, b,
            area * (beta * shape.value[a] * shape.value[b] - shape.value[a] * flow[b] -
                    flow[a] * shape.value[b]));
    }
  }

  // Each connected piece needs a temperature from somewhere.
  void refuse_undetermined() const {
    std::vector<std::uint32_t> root(nodes_.elements.size());
    std::iota(root.begin(), root.end(), 0u);
    const auto find = [&](std::uint32_t n) {
      while (root[n] != n) n = root[n] = root[root[n]];
      return n;
    };
    const auto node = [&](std::uint32_t cell, std::size_t a) {
      return static_cast<std::uint32_t>(unknown(cell, a));
    };
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c)
      for (std::size_t a = 1; a < 8; ++a) root[find(node(c, a))] = find(node(c, 0));
    std::vector<std::uint8_t> known(root.size(), 0);
    for (const FaceOfCells& face : faces_)
      for (const FacePoint& point : face.points)
        if (face.face->kind == HeatFace::Kind::temperature || face.face->kind == HeatFace::Kind::convection)
          known[find(node(point.cell, 0))] = 1;
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c)
      if (!known[find(node(c, 0))])
        throw InputError(
            settings_.faces[0].origin,
            fmt::format("part \"{}\": nothing gives the temperature of all of it: add [[temperature]] or "
                        "[[convection]] (parts do not pass heat to each other)",
                        body_.parts[part_[nodes_.cells[c]]].name));
  }

  const Body& body_;
  const Scene& scene_;
  const ThermalSettings& settings_;
  Fragments fragments_;
  Problem problem_;
  QuadraticNodes nodes_;
  std::vector<std::uint32_t> part_;   // (cells)
  std::vector<double> conductivity_;  // (parts) W/(m K)
  double zero_ = 0;                   // K
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_, temperature_;
  std::vector<FaceOfCells> faces_;
  std::vector<const HeatFace*> held_;  // (polygons) whose temperature is given, by what; else null
  std::vector<std::string> warnings_;
};

}  // namespace

void conduct(Body& body, const Scene& scene, Progress& progress) {
  body.element_columns.erase(kTemperatureColumn);
  Thermal::refuse_unfit(scene.get<Thermal>(), body, models_of_parts(scene, body),
                        materials_of_parts(scene, body));
  Conduction conduction(body, scene);
  for (const std::string& warning : conduction.warnings()) progress.warn(scene.name + ": " + warning);
  const std::vector<double> temperature = conduction.solve(progress);
  const std::vector<double> heat = conduction.heat();
  const auto [low, high] = conduction.range();
  if (low < -1e-3 * (high - low))  // what a face at 0 K may be off by
    throw InputError(scene.name,
                     fmt::format("conduction gives {} degC, below absolute zero: less heat can be drawn than "
                                 "that; check the signs and sizes of power, flux and coefficient",
                                 human_number(low - kIce, 5)));
  progress.say(
      fmt::format("temperature {} to {} degC", human_number(low - kIce, 4), human_number(high - kIce, 4)));
  for (std::size_t f = 0; f < heat.size(); ++f)
    progress.say(fmt::format("heat through \"{}\": {} W", conduction.face_name(f), human_number(heat[f], 4)));
  body.element_columns[kTemperatureColumn] = {1, temperature};
}

}  // namespace flexel::simulate
