// flexel measure: the effective elastic constants of a lattice beside those of its material.
#include <fmt/format.h>

#include <optional>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "base/program/arguments.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/measure/material_test.h"

namespace flexel::commands {
namespace {

constexpr int kCells[] = {2, 4, 8};

struct MeasureArguments {
  std::string model = "cells", hooke = "paper", material = "steel", size;
  std::optional<double> poisson;
  bool json = false;
};

struct Measured {
  simulate::Material material;
  double spacing = 0;
  std::vector<MeasuredDirection> inside;
  std::vector<MeasuredBar> bars;
  std::optional<MeasuredBar> limit;  // of a model whose order is two
};

simulate::Model model_named(const std::string& name) {
  if (name == "cells") return simulate::Model::cells;
  if (name == "springs") return simulate::Model::springs;
  if (name == "paper") return simulate::Model::paper;
  throw InputError(
      fmt::format("--model: no model \"{}\"{}", name, did_you_mean(name, {"cells", "springs", "paper"})));
}

simulate::HookeConstant hooke_named(const std::string& name) {
  if (name == "paper") return simulate::HookeConstant::paper;
  if (name == "ganovelli") return simulate::HookeConstant::ganovelli;
  if (name == "isotropic") return simulate::HookeConstant::isotropic;
  throw InputError(fmt::format("--hooke: no Hooke constant \"{}\"{}; known: paper, ganovelli, isotropic",
                               name, did_you_mean(name, {"paper", "ganovelli", "isotropic"})));
}

Measured measured(const MeasureArguments& arguments) {
  const simulate::Model model = model_named(arguments.model);
  const simulate::HookeConstant hooke = hooke_named(arguments.hooke);
  Measured result;
  const simulate::Material* found = simulate::library_material(arguments.material);
  if (!found)
    throw InputError(
        fmt::format("--material: no material \"{}\"; `flexel materials` lists them", arguments.material));
  result.material = *found;
  if (arguments.poisson) result.material.poisson = *arguments.poisson;
  if (!(result.material.poisson > -1 && result.material.poisson < 0.5))
    throw InputError("--poisson: needs to lie above -1 and below 0.5");
  result.spacing = parse_quantity(arguments.size, Dimension::length);
  if (!(result.spacing > 0)) throw InputError("--size: must be above zero");
  result.inside = measure_inside(model, hooke, result.material, result.spacing);
  for (const int cells : kCells)
    result.bars.push_back(measure_bar(model, hooke, result.material, result.spacing, cells));
  if (model != simulate::Model::paper) result.limit = limit_of(result.bars.end()[-2], result.bars.back());
  return result;
}

// "210 GPa +0.00 %"
std::string modulus(double value, double input) {
  return fmt::format("{} {:+.2f} %", human_pressure(value), 100 * (value / input - 1));
}

// "[110]"
std::string direction(const Vec3& unit) {
  std::string text = "[";
  for (const double each : unit) text += std::abs(each) < 1e-9 ? "0" : each > 0 ? "1" : "-1";
  return text + "]";
}

std::string text_of(const MeasureArguments& arguments, const Measured& found) {
  const double young = found.material.young, shear = shear_modulus(found.material);
  std::string text = fmt::format("model {}, {} as given: E {}, nu {:.4f}, G {}; cells of {}\n\n",
                                 arguments.model, found.material.name, human_pressure(young),
                                 found.material.poisson, human_pressure(shear), human_length(found.spacing));
  text += fmt::format("{:<7} {:<7} {:<20} {:<8} {}\n", "along", "across", "E inside", "nu", "G");
  for (const MeasuredDirection& each : found.inside)
    text += fmt::format("{:<7} {:<7} {:<20} {:<8.4f} {}\n", direction(each.along), direction(each.across),
                        modulus(each.young, young), each.poisson, modulus(each.shear, shear));
  text += fmt::format("\n{:<14} {:<17} {:<7} {:<17} {:<17} {}\n", "cells through", "E drawn", "nu",
                      "G sheared", "E bent", "G twisted");
  const auto row = [&](const std::string& name, const MeasuredBar& each) {
    text += fmt::format("{:<14} {:<17} {:<7.4f} {:<17} {:<17} {}\n", name, modulus(each.tension, young),
                        each.poisson, modulus(each.shear, shear), modulus(each.bending, young),
                        modulus(each.torsion, shear));
  };
  for (const MeasuredBar& each : found.bars) row(std::to_string(each.cells), each);
  if (!found.limit) return text;
  row("ever more", *found.limit);
  // what the finest bar is off by, times n^2
  const MeasuredBar& fine = found.bars.back();
  const auto shape = [&](double measured, double limit) {
    return 100 * (measured / limit - 1) * fine.cells * fine.cells;
  };
  return text +
         fmt::format(
             "\nInside, drawn and sheared: the material. Bent and twisted bars strain unevenly within a "
             "cell; what a bar n cells\nthrough is off by there is the shape's, not the material's: near "
             "{:+.0f}/n^2 % bent, {:+.0f}/n^2 % twisted (\"ever more\" leaves it out).\n",
             shape(fine.bending, found.limit->bending), shape(fine.torsion, found.limit->torsion));
}

std::string json_of(const MeasureArguments& arguments, const Measured& found) {
  nlohmann::ordered_json json = {{"model", arguments.model},
                                 {"young", found.material.young},
                                 {"poisson", found.material.poisson},
                                 {"shear", shear_modulus(found.material)},
                                 {"spacing", found.spacing}};
  for (const MeasuredDirection& each : found.inside)
    json["inside"].push_back({{"along", direction(each.along)},
                              {"across", direction(each.across)},
                              {"young", each.young},
                              {"poisson", each.poisson},
                              {"shear", each.shear}});
  const auto bar = [](const MeasuredBar& each) {
    return nlohmann::ordered_json{{"young_drawn", each.tension},
                                  {"poisson", each.poisson},
                                  {"shear_sheared", each.shear},
                                  {"young_bent", each.bending},
                                  {"shear_twisted", each.torsion}};
  };
  for (const MeasuredBar& each : found.bars) {
    json["bars"].push_back({{"cells", each.cells}});
    json["bars"].back().update(bar(each));
  }
  if (found.limit) json["limit"] = bar(*found.limit);
  return json_text(json, 2) + "\n";
}

}  // namespace

int measure_command(int argc, char** argv) {
  MeasureArguments arguments;
  CommandLine app{
      "Draws, bends and twists bars of lattice and prints the E, nu and G that they have, beside those of "
      "the "
      "material (docs/measurements/accuracy.md).",
      "flexel measure"};
  app.add_option("--model", arguments.model, "cells, springs or paper").type_name("NAME").show_default();
  app.add_option("--size", arguments.size, "Spacing of the lattice (\"2 mm\")")
      .type_name("LENGTH")
      .required();
  app.add_option("--material", arguments.material, "From the library (`flexel materials`)")
      .type_name("NAME")
      .show_default();
  app.add_option("--poisson", arguments.poisson, "Poisson's ratio in place of the material's")
      .type_name("NU");
  app.add_option("--hooke", arguments.hooke, "Model paper: paper, ganovelli or isotropic")
      .type_name("NAME")
      .show_default();
  app.add_flag("--json", arguments.json, "As JSON, in SI units");
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  const Measured found = measured(arguments);
  OutputFile out("-", false);
  out.write(arguments.json ? json_of(arguments, found) : text_of(arguments, found));
  out.commit();
  return kExitDone;
}

}  // namespace flexel::commands
