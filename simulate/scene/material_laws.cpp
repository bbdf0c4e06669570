// Keys of the elastic laws (docs/theory/laws.md).
#include "simulate/scene/material_laws.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"

namespace flexel::simulate {
namespace {

double pressure(TableReader& reader, const char* key, const char* example) {
  return reader.to_quantity(reader.require(key, example), Dimension::pressure, key);
}

// Three items of an array, each as a pressure or as a bare number.
Vec3 three(TableReader& reader, const char* key, bool pressures, const char* example) {
  const SceneValue& value = reader.require(key, example);
  if (value.kind != SceneValue::Kind::array || value.items.size() != 3)
    reader.fail(value.line, fmt::format("\"{}\" needs three values, for example {}", key, example));
  Vec3 result;
  for (std::size_t i = 0; i < 3; ++i) {
    const SceneValue& item = value.items[i];
    if (!pressures && item.kind != SceneValue::Kind::number)
      reader.fail(value.line, fmt::format("\"{}\" needs bare numbers, for example {}", key, example));
    result[static_cast<Eigen::Index>(i)] =
        pressures ? reader.to_quantity(item, Dimension::pressure, key) : item.number;
  }
  return result;
}

void parse_neo_hooke(TableReader& reader, Material& material) {
  material.young = pressure(reader, "young", "\"210 GPa\"");
  (void)reader.require("poisson", "0.3");
  material.poisson = *reader.number("poisson");
}

// `of`, words for mu / `times`.
void refuse_bulk(TableReader& reader, double bulk, double mu, const char* of, int times) {
  if (!(bulk > 0)) reader.fail("\"bulk\" needs to be above 0");
  constexpr double kStiffest = 1e4;  // times mu: beyond, volume locks and the solver fails
  if (bulk > kStiffest * mu)
    reader.fail(
        fmt::format("\"bulk\" is more than {:.0f} times {}: take a smaller one; a thousand times is "
                    "incompressible",
                    times * kStiffest, of));
}

void parse_mooney_rivlin(TableReader& reader, Material& material) {
  material.c10 = pressure(reader, "c10", "\"0.3 MPa\"");
  material.c01 = pressure(reader, "c01", "\"0.1 MPa\"");
  material.bulk = pressure(reader, "bulk", "\"40 MPa\"");
  if (!(material.c10 >= 0 && material.c01 >= 0 && material.c10 + material.c01 > 0))
    reader.fail("\"c10\" and \"c01\" need to be 0 or more, and one of them above 0");
  refuse_bulk(reader, material.bulk, 2 * (material.c10 + material.c01), "c10 + c01", 2);
}

void parse_arruda_boyce(TableReader& reader, Material& material) {
  material.chain_mu = pressure(reader, "mu", "\"0.27 MPa\"");
  (void)reader.require("lambda_m", "5.15, the stretch at which the chains end");
  material.lambda_m = *reader.number("lambda_m");
  material.bulk = pressure(reader, "bulk", "\"40 MPa\"");
  if (!(material.chain_mu > 0)) reader.fail("\"mu\" needs to be above 0");
  if (!(material.lambda_m > 1.01 && material.lambda_m <= 1e3))
    reader.fail("\"lambda_m\", the stretch at which the chains end, needs to be above 1.01 and at most 1000");
  refuse_bulk(reader, material.bulk, law_of(material).mu, "the shear modulus at small strain", 1);
}

void parse_orthotropic(TableReader& reader, Material& material) {
  material.youngs = three(reader, "young", true, "[\"10 GPa\", \"1 GPa\", \"1 GPa\"]");
  material.poissons = three(reader, "poisson", false, "[0.3, 0.3, 0.4] (nu12, nu13, nu23)");
  material.shears = three(reader, "shear", true, "[\"0.7 GPa\", \"0.7 GPa\", \"0.3 GPa\"] (G12, G13, G23)");
  if (!(material.youngs.minCoeff() > 0)) reader.fail("\"young\" needs to be above 0 along every axis");
  if (!(material.shears.minCoeff() > 0)) reader.fail("\"shear\" needs to be above 0 in every plane");
  const Mat3 straight = compliance(material).topLeftCorner<3, 3>();
  const Vec3 scale = straight.diagonal().cwiseSqrt().cwiseInverse();
  const Mat3 even = scale.asDiagonal() * straight * scale.asDiagonal();
  const double minor = std::min({1 - even(0, 1) * even(0, 1), 1 - even(0, 2) * even(0, 2),
                                 1 - even(1, 2) * even(1, 2), even.determinant()});
  if (!(minor > 1e-9))
    reader.fail(
        "\"young\" and \"poisson\" are of no stable material: the size of nu_ij needs to be below sqrt(E_i / "
        "E_j), and 1 "
        "- "
        "nu12^2 E2/E1 - nu13^2 E3/E1 - nu23^2 E3/E2 - 2 nu12 nu13 nu23 E3/E1 above 0; nu_ij is the "
        "contraction "
        "along j by a pull along i");
}

}  // namespace

void parse_law(TableReader& reader, Material& material) {
  const std::string law = reader.text("law").value_or("neo-hooke");
  if (law == "neo-hooke") {
    parse_neo_hooke(reader, material);
  } else if (law == "mooney-rivlin") {
    material.law = LawName::mooney_rivlin;
    parse_mooney_rivlin(reader, material);
  } else if (law == "arruda-boyce") {
    material.law = LawName::arruda_boyce;
    parse_arruda_boyce(reader, material);
  } else if (law == "orthotropic") {
    material.law = LawName::orthotropic;
    parse_orthotropic(reader, material);
  } else {
    reader.fail(
        reader.find("law")->line,
        fmt::format("no law \"{}\"{}; known: neo-hooke, mooney-rivlin, arruda-boyce, orthotropic", law,
                    did_you_mean(law, {"neo-hooke", "mooney-rivlin", "arruda-boyce", "orthotropic"})));
  }
  set_isotropic_constants(material);
}

std::optional<Mat3> parse_axes(TableReader& reader) {
  const SceneValue* value = reader.find("axes");
  if (!value) return std::nullopt;
  constexpr const char* example = "axes = [[1, 0, 0], [0, 1, 0]], the material's first and second axis";
  std::array<Vec3, 2> given;
  if (value->kind != SceneValue::Kind::array || value->items.size() != 2)
    reader.fail(value->line, fmt::format("\"axes\" needs two directions, for example {}", example));
  for (std::size_t a = 0; a < 2; ++a) {
    const SceneValue& direction = value->items[a];
    if (direction.kind != SceneValue::Kind::array || direction.items.size() != 3)
      reader.fail(value->line, fmt::format("\"axes\" needs two directions, for example {}", example));
    for (std::size_t i = 0; i < 3; ++i) {
      if (direction.items[i].kind != SceneValue::Kind::number)
        reader.fail(value->line, fmt::format("\"axes\" needs bare numbers, for example {}", example));
      given[a][static_cast<Eigen::Index>(i)] = direction.items[i].number;
    }
  }
  const double lengths = given[0].norm() * given[1].norm();
  if (!(lengths > 0 && std::isfinite(lengths)) || !(given[0].cross(given[1]).norm() > 1e-6 * lengths))
    reader.fail(value->line, "\"axes\" needs two directions that are not parallel");
  if (std::abs(given[0].dot(given[1])) > 1e-3 * lengths)
    reader.fail(value->line, "\"axes\" needs two directions at a right angle to each other");
  Mat3 axes;
  axes.col(0) = given[0].normalized();
  axes.col(2) = given[0].cross(given[1]).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

}  // namespace flexel::simulate
