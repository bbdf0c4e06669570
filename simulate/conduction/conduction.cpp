// Unknowns are temperatures above that of the first face, so that little cancels.
#include "simulate/conduction/conduction.h"

#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/human.h"
#include "formats/lattice/cell_moments.h"
#include "simulate/matter/fragments.h"
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

using Matrix = Eigen::SparseMatrix<double>;
using Corners = std::array<double, 8>;

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
    for (std::uint32_t c = 0; c < nodes_.cells.size(); ++c) add_cell(c);
    for (const HeatFace& face : settings_.faces) add_face(face);
    refuse_undetermined();
  }

  // (elements) K.
  [[nodiscard]] std::vector<double> solve() {
    const auto n = static_cast<Eigen::Index>(nodes_.elements.size());
    Matrix matrix(n, n);
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper, Eigen::IncompleteCholesky<double>> solver;
    solver.setTolerance(kTolerance);
    solver.setMaxIterations(kMostIterations);
    solver.compute(matrix);
    temperature_ = solver.solve(right_);
    if (solver.info() != Eigen::Success || !temperature_.allFinite())
      throw DivergedError(scene_.name + ": heat conduction did not converge; use a smaller --size");
    std::vector<double> all(body_.element_count(), zero_ + (n > 0 ? temperature_.mean() : 0));
    for (Eigen::Index i = 0; i < n; ++i)
      all[nodes_.elements[static_cast<std::size_t>(i)]] = zero_ + temperature_[i];
    return all;
  }

  // W, into the part through each face.
  [[nodiscard]] std::vector<double> heat() const {
    std::vector<double> sums;
    for (const FaceOfCells& face : faces_) {
      double sum = 0;
      for (const FacePoint& point : face.points) {
        const TrilinearShape shape = shape_at(lattice(point.cell), point.at);
        const Vec3 normal = point.area_vector.normalized();
        double here = 0, flow = 0;
        for (std::size_t a = 0; a < 8; ++a) {
          const double value = temperature_[unknown(point.cell, a)];
          here += shape.value[a] * value;
          flow += conductivity(point.cell) * shape.gradient[a].dot(normal) * value;
        }
        const double area = point.area_vector.norm();
        if (face.face->kind == HeatFace::Kind::temperature)
          sum += area * (flow - penalty(point.cell) * (here - face.value));
        else if (face.face->kind == HeatFace::Kind::convection)
          sum += area * face.face->value * (face.value - here);
        else
          sum += area * face.value;
      }
      sums.push_back(sum);
    }
    return sums;
  }

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
    FaceOfCells made{&face, in_firm_cells(body_, nodes_, face_points(problem_, nodes_, selected.polygons)),
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
};

}  // namespace

void conduct(Body& body, const Scene& scene, Progress& progress) {
  body.element_columns.erase(kTemperatureColumn);
  Conduction conduction(body, scene);
  const std::vector<double> temperature = conduction.solve();
  const std::vector<double> heat = conduction.heat();
  constexpr double kIce = 273.15;
  const auto [low, high] = std::minmax_element(temperature.begin(), temperature.end());
  progress.say(
      fmt::format("temperature {} to {} degC", human_number(*low - kIce, 4), human_number(*high - kIce, 4)));
  for (std::size_t f = 0; f < heat.size(); ++f)
    progress.say(fmt::format("heat through \"{}\": {} W", conduction.face_name(f), human_number(heat[f], 4)));
  body.element_columns[kTemperatureColumn] = {1, temperature};
}

}  // namespace flexel::simulate
