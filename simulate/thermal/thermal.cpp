// [thermal], [shrinkage], [[temperature]], [[heat]] and [[convection]] of a scene.
#include "simulate/thermal/thermal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "simulate/input/scene_selection.h"

namespace flexel::simulate {
namespace {

using D = Dimension;

TemperatureChange parse_change(TableReader& reader) {
  TemperatureChange entry;
  entry.origin = reader.place();
  const std::optional<double> change = reader.quantity("change", D::temperature_difference);
  const std::optional<Vec3> gradient = reader.vector("gradient", D::temperature_gradient);
  const std::optional<Vec3> about = reader.vector("about", Dimension::length);
  entry.change = change.value_or(0);
  entry.gradient = gradient.value_or(Vec3::Zero());
  entry.about = about.value_or(Vec3::Zero());
  entry.column = reader.text("column").value_or("");
  entry.reference = reader.quantity("reference", D::temperature);
  entry.part = reader.text("part");
  reader.finish();
  if (!change && !gradient && !entry.reference)
    reader.fail(
        "[thermal] needs \"change\" (for example \"80 K\"), \"gradient\", or \"reference\" with a \"column\" "
        "or "
        "with [[temperature]]");
  if (about && !gradient) reader.fail("\"about\" is where \"gradient\" gives nothing; give one");
  if (!entry.column.empty() && !entry.reference)
    reader.fail(
        "\"column\" needs \"reference\", the temperature at which the part has its shape: \"20 degC\"");
  return entry;
}

std::vector<double> parse_list(TableReader& reader, const char* key, bool length) {
  std::vector<double> list;
  const SceneValue* value = reader.find(key);
  if (value == nullptr) return list;
  for (const SceneValue& item : value->items) {
    if (!length && item.kind != SceneValue::Kind::number)
      reader.fail(value->line, "\"factor\" needs bare numbers");
    list.push_back(length ? reader.to_quantity(item, Dimension::length, key) : item.number);
    if (!std::isfinite(list.back()))
      reader.fail(value->line, fmt::format("\"{}\" needs finite numbers", key));
  }
  return list;
}

Shrinkage parse_shrinkage(TableReader& reader) {
  Shrinkage entry;
  entry.origin = reader.place();
  entry.axis = reader.direction("axis").value_or(Vec3::UnitZ());
  entry.layer = reader.to_quantity(reader.require("layer", "\"0.2 mm\""), Dimension::length, "layer");
  entry.along = reader.to_quantity(reader.require("along", "\"-0.2 %\""), Dimension::share, "along");
  entry.across = reader.to_quantity(reader.require("across", "\"-0.3 %\""), Dimension::share, "across");
  entry.height = parse_list(reader, "height", true);
  entry.factor = parse_list(reader, "factor", false);
  entry.part = reader.text("part");
  reader.finish();
  if (!(entry.layer > 0)) reader.fail("\"layer\" needs to be above 0");
  if (entry.height.size() != entry.factor.size())
    reader.fail("\"height\" and \"factor\" go together: height = [\"0 mm\", \"10 mm\"], factor = [0.5, 1]");
  for (std::size_t i = 1; i < entry.height.size(); ++i)
    if (!(entry.height[i] > entry.height[i - 1])) reader.fail("\"height\" needs to ascend");
  return entry;
}

HeatFace parse_face(TableReader& reader, HeatFace::Kind kind) {
  HeatFace face;
  face.kind = kind;
  face.origin = reader.place();
  face.where = require_where(reader);
  face.name = reader.text("name").value_or(describe(face.where));
  const auto required = [&](const char* key, D dimension, const char* example) {
    (void)reader.require(key, example);
    return *reader.quantity(key, dimension);
  };
  if (kind == HeatFace::Kind::temperature) {
    face.value = required("value", D::temperature, "\"100 degC\"");
  } else if (kind == HeatFace::Kind::convection) {
    face.value = required("coefficient", D::heat_transfer, "\"10 W/(m2 K)\"");
    face.ambient = required("ambient", D::temperature, "\"20 degC\"");
    if (!(face.value > 0)) reader.fail("\"coefficient\" needs to be above 0");
  } else {
    const auto flux = reader.quantity("flux", D::heat_flux), power = reader.quantity("power", D::power);
    if (flux.has_value() == power.has_value())
      reader.fail(
          "[[heat]] needs either \"flux\" (\"1000 W/m2\", into the part) or \"power\" (\"5 W\", in total)");
    face.kind = flux ? HeatFace::Kind::flux : HeatFace::Kind::power;
    face.value = flux ? *flux : *power;
  }
  reader.finish();
  return face;
}

void parse_figures(TableReader& scene, ThermalSettings& settings) {
  const SceneValue* materials = scene.find("materials");
  if (materials == nullptr) return;
  for (const auto& [name, value] : materials->members) {
    if (value.kind != SceneValue::Kind::table) continue;
    TableReader reader(value, scene.file(), fmt::format("[materials.{}]", name));
    ThermalFigures figures;
    figures.expansion = reader.quantity("expansion", D::expansion);
    figures.conductivity = reader.quantity("conductivity", D::conductivity);
    if (figures.conductivity && !(*figures.conductivity > 0))
      reader.fail("\"conductivity\" needs to be above 0");
    settings.materials[name] = figures;
  }
}

const std::string& origin_of(const ThermalSettings& settings) {
  return !settings.changes.empty()      ? settings.changes[0].origin
         : !settings.shrinkages.empty() ? settings.shrinkages[0].origin
                                        : settings.faces[0].origin;
}

}  // namespace

void Thermal::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("thermal")) {
    TableReader reader(*table, scene.file(), "[thermal]");
    parameters.changes.push_back(parse_change(reader));
  }
  for (const SceneValue* table : scene.tables("shrinkage")) {
    TableReader reader(*table, scene.file(), "[shrinkage]");
    parameters.shrinkages.push_back(parse_shrinkage(reader));
  }
  for (const auto& [key, kind] : {std::pair{"temperature", HeatFace::Kind::temperature},
                                  {"heat", HeatFace::Kind::flux},
                                  {"convection", HeatFace::Kind::convection}})
    for (const SceneValue* table : scene.tables(key)) {
      TableReader reader(*table, scene.file(), fmt::format("[[{}]]", key));
      parameters.faces.push_back(parse_face(reader, kind));
    }
  parse_figures(scene, parameters);
  const auto from_conduction = [](const TemperatureChange& each) { return each.reference.has_value(); };
  if (parameters.conducts() && !parameters.changes.empty() &&
      std::none_of(parameters.changes.begin(), parameters.changes.end(), from_conduction))
    throw InputError(parameters.changes.front().origin,
                     "[thermal] has no \"reference\", so the temperatures of [[temperature]], [[heat]] and "
                     "[[convection]] would expand nothing: give the one at which the part has its shape, "
                     "reference = \"20 degC\", or leave these out");
  for (const TemperatureChange& change : parameters.changes)
    if (change.reference && change.column.empty() && !parameters.conducts())
      throw InputError(
          change.origin,
          "\"reference\" is that of a \"column\" or of [[temperature]] and [[convection]]; give one, or "
          "\"change\" alone");
}

void Thermal::refuse_unfit(const Parameters& parameters, const Body& body, const std::vector<Model>& models,
                           const std::vector<Material>& materials) {
  for (std::size_t p = 0; p < models.size(); ++p) {
    const std::string& part = body.parts[p].name;
    if (models[p] != Model::cells && models[p] != Model::quadratic)
      throw InputError(origin_of(parameters),
                       fmt::format("part \"{}\": {} is for models \"quadratic\" and \"cells\", and it "
                                   "has model \"{}\"",
                                   part, parameters.expands() ? "free strain" : "conduction",
                                   models[p] == Model::springs ? "springs" : "paper"));
    if (parameters.expands() && models[p] == Model::cells && materials[p].law != LawName::neo_hooke)
      throw InputError(origin_of(parameters),
                       fmt::format("part \"{}\": free strain of law \"{}\" is for model \"quadratic\"; write "
                                   "model = \"quadratic\"",
                                   part, law_name(materials[p].law)));
  }
}

std::optional<Thermal> Thermal::make(const Parameters& parameters, const Problem& problem) {
  if (!parameters.expands() && !parameters.conducts()) return std::nullopt;
  if (problem.duration)
    throw InputError(origin_of(parameters),
                     "heat and shrinkage act at equilibrium only: leave [run] time and contact out");
  refuse_unfit(parameters, problem.body, problem.models, problem.materials);
  Thermal made;
  made.why_ = fmt::format("{} [thermal], {} [shrinkage], {} face(s) of conduction", parameters.changes.size(),
                          parameters.shrinkages.size(), parameters.faces.size());
  return made;
}

}  // namespace flexel::simulate
