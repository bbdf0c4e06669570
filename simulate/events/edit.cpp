// Factors are kept in columns, less 1, so that 0 is what was never edited; tractions as they are.
#include "simulate/events/edit.h"

#include <fmt/format.h>

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
  made.stick_ = reader.quantity("stick", Dimension::pressure).value_or(0);
  if (made.stiffness_ == 1 && made.damping_ == 1 && made.density_ == 1 && made.stick_ == 0)
    reader.fail(
        "edit needs \"stiffness\", \"damping\" or \"density\", factors on what there is, for example "
        "stiffness = 2, or \"stick\", a traction more");
  return made;
}

std::string Edit::apply(EventContext& context) const {
  const Chosen chosen = choose(region_, context.body, context.state);
  std::vector<std::uint8_t> elements = chosen.elements;
  for (const Part& part : context.body.parts)
    if (part.placement == Placement::corner)
      std::fill(elements.begin() + part.element_begin, elements.begin() + part.element_end, 0);
  const bool by_elements = std::find(elements.begin(), elements.end(), 1) != elements.end();
  for (const auto& [column, by] : {std::pair{"stiffness_change", stiffness_},
                                   {"damping_change", damping_},
                                   {"density_change", density_}}) {
    multiply(context.body.cell_columns, column, chosen.cells, by);
    if (by_elements) multiply(context.body.element_columns, column, elements, by);
  }
  add_stick(context.body, chosen.elements, stick_);
  return fmt::format("{}: stiffness times {}, damping times {}, density times {}{}", describe(region_),
                     stiffness_, damping_, density_,
                     stick_ != 0 ? fmt::format(", sticks with {} Pa more", stick_) : "");
}

}  // namespace flexel::simulate
