// The strains are 1e-6: small enough for the models' large deformation not to show.
#include "flexel/measure/material_test.h"

#include <cmath>

#include "base/math/dense.h"
#include "simulate/models/cells.h"
#include "simulate/models/central_spring.h"
#include "simulate/models/connections.h"
#include "simulate/result/options.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"

namespace flexel::commands {
namespace {

constexpr double kStrain = 1e-6;
// Torsion constant of a square bar over the fourth power of its side (Saint-Venant; Timoshenko and Goodier
// 1970, section 109).
constexpr double kSquareTorsion = 0.140577;

using Mat6 = Eigen::Matrix<double, 6, 6>;

Lattice cubic(double spacing) {
  return {Vec3::Zero(), Mat3::Identity(), Vec3::Constant(spacing)};
}

// Energy per volume of the lattice under a displacement gradient.
double density(simulate::Model model, simulate::HookeConstant hooke, const simulate::Material& material,
               double h, const Mat3& gradient) {
  if (model == simulate::Model::paper) {
    double energy = 0;
    for (const simulate::ConnectionKind& kind : connection_kinds(cubic(h), material, hooke)) {
      if (!(kind.stiffness > 0)) continue;
      const double elongation = simulate::stretch(kind.rest, gradient * kind.rest).elongation;
      energy += 0.5 * kind.stiffness * elongation * elongation;
    }
    return energy / (h * h * h);
  }
  simulate::CellVectors u;
  for (std::size_t a = 0; a < 8; ++a)
    u[a] = gradient * (h * Vec3(static_cast<double>(a & 1), static_cast<double>(a >> 1 & 1),
                                static_cast<double>(a >> 2)));
  const double energy = model == simulate::Model::springs ? cell_energy(spring_kind(cubic(h), material), u)
                                                          : cell_energy(cell_kind(cubic(h), material), u);
  return energy / (h * h * h);
}

// Unit strain of Voigt's component xx, yy, zz, yz, zx, xy (shear as an angle).
Mat3 unit_strain(int component) {
  Mat3 strain = Mat3::Zero();
  if (component < 3) {
    strain(component, component) = 1;
  } else {
    const int i = (component - 2) % 3, j = (component - 1) % 3;
    strain(i, j) = strain(j, i) = 0.5;
  }
  return strain;
}

Eigen::Matrix<double, 6, 1> voigt_stress(const Mat3& s) {
  Eigen::Matrix<double, 6, 1> v;
  v << s(0, 0), s(1, 1), s(2, 2), s(1, 2), s(2, 0), s(0, 1);
  return v;
}

// Elements of a bar along x, with the cells or the connections between them.
Body bar(simulate::Model model, double h, const std::array<int, 3>& cells) {
  const bool corner = model != simulate::Model::paper;
  const int more = corner ? 1 : 0;
  const std::array<int, 3> n{cells[0] + more, cells[1] + more, cells[2] + more};
  Body body;
  Part part;
  part.name = "bar";
  part.placement = corner ? Placement::corner : Placement::centre;
  part.lattice = cubic(h);
  const auto id = [&](int i, int j, int k) { return static_cast<std::uint32_t>(i + n[0] * (j + n[1] * k)); };
  const auto inside = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2];
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        body.lattice_index.push_back({i, j, k});
        body.rest.push_back(part.lattice.to_world(Vec3(i, j, k) + (corner ? 0 : 0.5) * Vec3::Ones()));
        std::uint32_t bits = 0;
        for (std::size_t b = 0; b < half_neighbourhood.size(); ++b)
          if (const Index3& d = half_neighbourhood[b]; inside(i + d[0], j + d[1], k + d[2])) bits |= 1u << b;
        body.connections.push_back(bits);
      }
  if (corner)
    for (int k = 0; k < cells[2]; ++k)
      for (int j = 0; j < cells[1]; ++j)
        for (int i = 0; i < cells[0]; ++i) {
          std::array<std::uint32_t, 8> corners;
          for (int a = 0; a < 8; ++a)
            corners[static_cast<std::size_t>(a)] = id(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2));
          body.cell_elements.push_back(corners);
        }
  body.piece.assign(body.rest.size(), 0);
  body.position = body.rest;
  body.fill.assign(body.cell_count(), 1);
  body.broken.assign(body.cell_count(), 0);
  part.element_end = static_cast<std::uint32_t>(body.element_count());
  part.cell_end = static_cast<std::uint32_t>(body.cell_count());
  body.parts.push_back(part);
  body.surface.parts.push_back({"bar"});
  return body;
}

simulate::Selection beyond(const Vec3& point, const Vec3& normal) {
  simulate::Selection selection;
  selection.kind = simulate::Selection::Kind::half_space;
  selection.point = point;
  selection.normal = normal;
  return selection;
}

simulate::Selection ball(const Vec3& at, double radius) {
  simulate::Selection selection;
  selection.kind = simulate::Selection::Kind::sphere;
  selection.point = at;
  selection.radius = radius;
  return selection;
}

simulate::Tie tie(simulate::Selection where, const std::array<bool, 3>& axes,
                  const simulate::Motion& motion = {}) {
  simulate::Tie made = make_move(std::move(where), Vec3::Zero());
  made.axes = axes;
  made.motion = motion;
  return made;
}

// A bar between its two end planes of elements.
class Beam {
 public:
  Beam(simulate::Model model, simulate::HookeConstant hooke, const simulate::Material& material, double h,
       int n)
      : model_(model),
        hooke_(hooke),
        material_(material),
        h_(h),
        body_(bar(model, h, {4 * n, n, n})),
        side_(n * h) {
    low_ = body_.rest.front();
    high_ = body_.rest.back();
    length_ = high_.x() - low_.x();
    middle_ = 0.5 * (low_ + high_);
  }

  [[nodiscard]] const Body& body() const { return body_; }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] double side() const { return side_; }
  [[nodiscard]] const Vec3& low() const { return low_; }
  [[nodiscard]] const Vec3& high() const { return high_; }

  // Energy [J] with a displacement and its opposite prescribed at the two ends on `axes`, and `others` tied.
  double energy(const std::array<bool, 3>& axes, const simulate::Motion& motion,
                const std::vector<simulate::Tie>& others) {
    simulate::Scene scene;
    scene.name = "flexel measure";
    scene.materials["it"] = material_;
    scene.material = "it";
    scene.parts["bar"].model = model_ == simulate::Model::paper     ? "paper"
                               : model_ == simulate::Model::springs ? "springs"
                                                                    : "cells";
    if (model_ == simulate::Model::paper)
      scene.parts["bar"].hooke = hooke_ == simulate::HookeConstant::ganovelli   ? "ganovelli"
                                 : hooke_ == simulate::HookeConstant::isotropic ? "isotropic"
                                                                                : "paper";
    for (const double end : {-1.0, 1.0}) {
      simulate::Motion way = motion;
      way.through = middle_ + Vec3(end * length_ / 2, 0, 0);
      way.translation *= end;
      way.angle *= end;
      scene.get<simulate::Supports>().ties.push_back(
          tie(beyond(way.through - Vec3(0.25 * end * h_, 0, 0), Vec3(end, 0, 0)), axes, way));
    }
    for (const simulate::Tie& each : others) scene.get<simulate::Supports>().ties.push_back(each);
    scene.run.tolerance = 1e-10;
    simulate::SimulateOptions options;
    options.stress = options.estimate = false;
    Progress progress("flexel", Progress::Mode::silent);
    body_.position = body_.rest;
    return simulate::simulate(body_, scene, options, progress).elastic_energy;
  }

  // The two sides across y, moved along x by `way` and its opposite, and an element that holds z.
  [[nodiscard]] std::vector<simulate::Tie> frame_sides(double way) const {
    std::vector<simulate::Tie> ties{tie(ball(low_, 0.25 * h_), {false, false, true})};
    for (const double side : {-1.0, 1.0}) {
      simulate::Motion motion;
      motion.translation = Vec3(side * way, 0, 0);
      const double y = side < 0 ? low_.y() : high_.y();
      ties.push_back(
          tie(beyond(Vec3(0, y - 0.25 * side * h_, 0), Vec3(0, side, 0)), {true, false, false}, motion));
    }
    return ties;
  }

  // Holds the ways that a drawn or bent bar is free to go as a whole, at two elements of its middle.
  [[nodiscard]] std::vector<simulate::Tie> holds() const {
    const double x = body_.rest[static_cast<std::size_t>(std::lround(middle_.x() / h_))].x();
    return {tie(ball(Vec3(x, low_.y(), low_.z()), 0.25 * h_), {false, true, true}),
            tie(ball(Vec3(x, high_.y(), low_.z()), 0.25 * h_), {false, false, true})};
  }

 private:
  simulate::Model model_;
  simulate::HookeConstant hooke_;
  const simulate::Material& material_;
  double h_;
  Body body_;
  double side_, length_ = 0;
  Vec3 low_, high_, middle_;
};

}  // namespace

std::vector<MeasuredDirection> measure_inside(simulate::Model model, simulate::HookeConstant hooke,
                                              const simulate::Material& material, double spacing) {
  const auto energy = [&](const Mat3& strain) {
    return 0.5 *
           (density(model, hooke, material, spacing, kStrain * strain) +
            density(model, hooke, material, spacing, -kStrain * strain)) /
           (kStrain * kStrain);
  };
  Mat6 stiffness;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b)
      stiffness(a, b) =
          energy(unit_strain(a) + unit_strain(b)) - energy(unit_strain(a)) - energy(unit_strain(b));
  const Mat6 compliance = inverse_6(stiffness);
  std::vector<MeasuredDirection> result;
  for (const auto& [along, across] : {std::pair<Vec3, Vec3>{{1, 0, 0}, {0, 1, 0}},
                                      {{1, 1, 0}, {0, 0, 1}},
                                      {{1, 1, 0}, {1, -1, 0}},
                                      {{1, 1, 1}, {1, -1, 0}}}) {
    MeasuredDirection each{along.normalized(), across.normalized()};
    const auto pull = voigt_stress(each.along * each.along.transpose());
    const auto side = voigt_stress(each.across * each.across.transpose());
    const auto shear =
        voigt_stress(each.along * each.across.transpose() + each.across * each.along.transpose());
    each.young = 1 / pull.dot(compliance * pull);
    each.poisson = -side.dot(compliance * pull) * each.young;
    each.shear = 1 / shear.dot(compliance * shear);
    result.push_back(each);
  }
  return result;
}

MeasuredBar measure_bar(simulate::Model model, simulate::HookeConstant hooke,
                        const simulate::Material& material, double spacing, int cells) {
  MeasuredBar result;
  result.cells = cells;
  Beam beam(model, hooke, material, spacing, cells);
  const double length = beam.length(), side = beam.side();
  simulate::Motion draw;
  draw.translation = Vec3(kStrain * length / 2, 0, 0);
  result.tension =
      2 * beam.energy({true, false, false}, draw, beam.holds()) / (kStrain * kStrain * length * side * side);
  double moved = 0, count = 0;
  const Body& body = beam.body();
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const double from_middle = std::abs(body.rest[e].x() - (beam.low().x() + length / 2));
    if (from_middle > 0.6 * spacing) continue;
    if (body.rest[e].y() == beam.high().y()) moved += body.position[e].y() - body.rest[e].y();
    if (body.rest[e].y() == beam.low().y()) {
      moved -= body.position[e].y() - body.rest[e].y();
      count += 1;
    }
  }
  result.poisson = -moved / count / (kStrain * (beam.high().y() - beam.low().y()));
  simulate::Motion slide;
  slide.translation = Vec3(0, kStrain * length / 4, 0);
  const double height = beam.high().y() - beam.low().y();
  result.shear = 2 * beam.energy({false, true, false}, slide, beam.frame_sides(kStrain * height / 4)) /
                 (kStrain * kStrain * length * side * side);
  simulate::Motion bend;
  bend.axis = Vec3::UnitZ();
  bend.angle = kStrain * length / side;  // a strain of kStrain at the faces
  const double curvature = 2 * bend.angle / length;
  result.bending = 2 * beam.energy({true, false, false}, bend, beam.holds()) /
                   (curvature * curvature * length * std::pow(side, 4) / 12);
  simulate::Motion turn;
  turn.axis = Vec3::UnitX();
  turn.angle = kStrain * length / side;
  const double twist = 2 * turn.angle / length;
  simulate::Tie still = tie(ball(beam.low() + Vec3(length / 2, 0, 0), 0.8 * spacing), {true, false, false});
  result.torsion = 2 * beam.energy({false, true, true}, turn, {still}) /
                   (twist * twist * length * kSquareTorsion * std::pow(side, 4));
  return result;
}

MeasuredBar limit_of(const MeasuredBar& coarse, const MeasuredBar& fine) {
  const double ratio = static_cast<double>(fine.cells) / coarse.cells, weight = 1 / (ratio * ratio - 1);
  const auto limit = [&](double MeasuredBar::*what) {
    return fine.*what + weight * (fine.*what - coarse.*what);
  };
  MeasuredBar result;
  for (const auto what : {&MeasuredBar::tension, &MeasuredBar::bending, &MeasuredBar::poisson,
                          &MeasuredBar::shear, &MeasuredBar::torsion})
    result.*what = limit(what);
  return result;
}

}  // namespace flexel::commands
