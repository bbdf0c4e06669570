// Factors are kept in columns, less 1, so that 0 is what was never edited; tractions as they are.
#include "simulate/events/edit.h"

#include <fmt/format.h>

#include <tuple>

#include "base/error.h"
#include "base/files/append_text.h"
#include "formats/part/column.h"

namespace flexel::simulate {
namespace {

constexpr double kMostFactor = 1e6;  // of a factor, and one over it

double factor(TableReader& reader, const char* key) {
  const double value = reader.number(key).value_or(1);
  if (!(value >= 1 / kMostFactor && value <= kMostFactor))
    reader.fail(
        fmt::format("\"{}\" is a factor, above 0 (from {} to {})", key, 1 / kMostFactor, kMostFactor));
  return value;
}

// Column `name` holds the factor less 1.
void multiply(Columns& columns, const char* name, const std::vector<std::uint8_t>& chosen, double by) {
  if (by == 1 || chosen.empty()) return;
  Column& column = columns[name];
  if (column.components != 1 || column.values.size() != chosen.size())
    column = {1, std::vector<double>(chosen.size(), 0)};
  for (std::size_t i = 0; i < chosen.size(); ++i)
    if (chosen[i]) column.values[i] = (1 + column.values[i]) * by - 1;
}

// Of elements, whatever their placement: contact reads it at the points of the surface.
void add_stick(Body& body, const std::vector<std::uint8_t>& chosen, double more) {
  if (more == 0) return;
  Column& column = body.element_columns["stick_change"];
  if (column.components != 1 || column.values.size() != chosen.size())
    column = {1, std::vector<double>(chosen.size(), 0)};
  for (std::size_t e = 0; e < chosen.size(); ++e)
    if (chosen[e]) column.values[e] += more;
}

}  // namespace

Edit Edit::parse(TableReader& reader) {
  Edit made;
  made.region_ = parse_region(reader);
  made.stiffness_ = factor(reader, "stiffness");
  made.damping_ = factor(reader, "damping");
  made.density_ = factor(reader, "density");
  made.strength_ = factor(reader, "strength");
  made.yield_ = factor(reader, "yield");
  made.friction_ = factor(reader, "friction");
  made.radius_ = factor(reader, "radius");
  made.stick_ = reader.quantity("stick", Dimension::pressure).value_or(0);
  made.origin_ = reader.place();
  if (made.stiffness_ == 1 && made.damping_ == 1 && made.density_ == 1 && made.strength_ == 1 &&
      made.yield_ == 1 && made.friction_ == 1 && made.radius_ == 1 && made.stick_ == 0)
    reader.fail(
        "edit needs \"stiffness\", \"damping\", \"density\", \"strength\", \"yield\", \"friction\" or "
        "\"radius\", factors on what there is, for example stiffness = 2, or \"stick\", a traction more");
  return made;
}

std::string Edit::apply(EventContext& context) const {
  const Chosen chosen = choose(region_, context.body, context.state);
  std::vector<std::uint8_t> elements = chosen.elements;
  for (const Part& part : context.body.parts)
    if (part.placement == Placement::corner)
      std::fill(elements.begin() + part.element_begin, elements.begin() + part.element_end, 0);
  const bool by_elements = std::find(elements.begin(), elements.end(), 1) != elements.end();
  if (radius_ != 1 && elements != chosen.elements)
    throw InputError(origin_,
                     fmt::format("edit: {} has elements without a radius: \"radius\" is that of elements of "
                                 "model \"paper\"",
                                 describe(region_)));
  std::string factors;
  for (const auto& [called, column, by] : {std::tuple{"stiffness", "stiffness_change", stiffness_},
                                           {"damping", "damping_change", damping_},
                                           {"density", "density_change", density_},
                                           {"strength", "strength_change", strength_},
                                           {"yield", "yield_change", yield_}}) {
    multiply(context.body.cell_columns, column, chosen.cells, by);
    if (by_elements) multiply(context.body.element_columns, column, elements, by);
    if (by != 1) append_text(factors, ", {} times {}", called, by);
  }
  multiply(context.body.element_columns, "friction_change", chosen.elements, friction_);
  multiply(context.body.element_columns, "radius_change", elements, radius_);
  if (friction_ != 1) append_text(factors, ", friction times {}", friction_);
  if (radius_ != 1) append_text(factors, ", radius times {}", radius_);
  add_stick(context.body, chosen.elements, stick_);
  if (stick_ != 0) append_text(factors, ", sticks with {} Pa more", stick_);
  return describe(region_) + ":" + factors.substr(1);
}

}  // namespace flexel::simulate
