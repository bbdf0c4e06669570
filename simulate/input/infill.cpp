// Effective figures of prints that are not solid.
#include "simulate/input/infill.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/math/area_vector.h"
#include "base/units.h"
#include "formats/lattice/body.h"
#include "simulate/input/scene_table.h"

namespace flexel::simulate {
namespace {

constexpr double kOpenCells = 0.3;  // densest infill that counts as open cells; also their collapse's factor

double infill_strength(double infill) {
  return infill <= kOpenCells ? kOpenCells * std::pow(infill, 1.5) : std::pow(infill, 2.5);
}

}  // namespace

void check_infill(const Infill& infill, const std::string& origin) {
  if (infill.share && !(*infill.share >= kLeastInfill && *infill.share <= 1))
    throw InputError(origin, fmt::format("an infill of {:.4g} % needs to lie between {:.0f} % and 100 %, for "
                                         "example \"20 %\"",
                                         100 * *infill.share, 100 * kLeastInfill));
  if (infill.shell && !infill.share)
    throw InputError(origin, "a shell goes with an infill: give infill = \"20 %\" too");
  if (infill.shell && !(*infill.shell > 0)) throw InputError(origin, "the shell needs to be thicker than 0");
}

Infill parse_infill(TableReader& reader) {
  Infill infill;
  infill.share = reader.quantity("infill", Dimension::share);
  infill.shell = reader.quantity("shell", Dimension::length);
  for (const char* key : {"infill", "shell"})
    if (const SceneValue* value = reader.find(key)) check_infill(infill, reader.place(value->line));
  return infill;
}

double wall_share(double shell, const Part& part, const Surface& surface, std::size_t index,
                  const std::string& origin) {
  double area = 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (surface.polygon_part(p) == index) area += area_vector(surface.vertices, surface.polygon(p)).norm();
  if (!(part.surface_volume > 0))
    throw InputError(origin, fmt::format("part \"{}\" encloses no volume, so what share of it a shell is "
                                         "cannot be told: leave the shell out",
                                         part.name));
  const double x = std::min(2.0, shell * area / part.surface_volume);
  return x - x * x / 4;
}

Material with_infill(Material solid, double infill, double walls) {
  if (infill >= 1) return solid;
  const auto mixed = [&](double share) { return walls + (1 - walls) * share; };
  const double stiffness = mixed(infill * infill), strength = mixed(infill_strength(infill));
  solid.young *= stiffness;
  solid.hardening *= stiffness;
  solid.yield *= strength;
  solid.strength *= strength;
  solid.layer_strength *= strength;
  solid.density *= mixed(infill);
  solid.infill = infill;
  solid.walls = walls;
  return solid;
}

std::string infill_line(const std::string& part, const Material& material) {
  if (material.infill >= 1) return "";
  const std::string walls = material.walls > 0
                                ? fmt::format(", {:.0f} % of it solid walls", 100 * material.walls)
                                : ", no solid walls (--shell \"1 mm\", or shell in the scene, counts them)";
  return fmt::format(
      "\"{}\" is {} with {:.3g} % infill{}: as one even material of {} and {:.0f} kg/m3, an "
      "estimate, rather too soft (docs/reference/materials.md)",
      part, material.name, 100 * material.infill, walls, human_pressure(material.young), material.density);
}

}  // namespace flexel::simulate
