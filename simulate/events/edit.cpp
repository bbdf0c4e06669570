// Factors are kept in columns, less 1, so that 0 is what was never edited; tractions as they are.
#include "simulate/events/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "base/error.h"
#include "base/files/append_text.h"
#include "formats/part/column.h"
#include "simulate/models/connections.h"

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

// Rows of `chosen` that the column does not name yet; it names them then.
void take_unmarked(Columns& columns, const std::string& name, std::vector<std::uint8_t>& chosen) {
  if (chosen.empty()) return;
  Column& column = columns[name];
  if (column.components != 1 || column.values.size() != chosen.size())
    column = {1, std::vector<double>(chosen.size(), 0)};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (column.values[i] != 0) chosen[i] = 0;
    if (chosen[i]) column.values[i] = 1;
  }
}

// What an event that happens again and again has edited, by a column that is there between its first and its last time.
class EditedAlready {
 public:
  EditedAlready(EventContext& context, const std::string& origin)
      : context_(context), column_("edited_" + origin.substr(origin.rfind(':') + 1)) {
    if (context_.turn == 0) forget();
  }
  EditedAlready(const EditedAlready&) = delete;
  EditedAlready& operator=(const EditedAlready&) = delete;
  ~EditedAlready() {
    if (context_.turn + 1 == context_.turns) forget();
  }
  void leave_out(Chosen& chosen) {
    if (context_.turns == 1) return;
    take_unmarked(context_.body.cell_columns, column_, chosen.cells);
    take_unmarked(context_.body.element_columns, column_, chosen.elements);
  }

 private:
  void forget() {
    context_.body.cell_columns.erase(column_);
    context_.body.element_columns.erase(column_);
  }
  EventContext& context_;
  std::string column_;
};

// A cell, or an element at the centre of a voxel; where elements at corners have what is edited, any of them.
bool holds_any(const Body& body, const Chosen& chosen, bool at_corners) {
  if (std::find(chosen.cells.begin(), chosen.cells.end(), 1) != chosen.cells.end()) return true;
  return std::any_of(body.parts.begin(), body.parts.end(), [&](const Part& part) {
    const auto end = chosen.elements.begin() + part.element_end;
    return (at_corners || part.placement == Placement::centre) &&
           std::find(chosen.elements.begin() + part.element_begin, end, 1) != end;
  });
}

constexpr std::size_t kConnectionsOfElement = half_neighbourhood.size();

// A column of connections, 0 where it has not been.
Column& connection_column(Body& body, const char* name) {
  Column& column = body.element_columns[name];
  if (column.values.empty())
    column = {static_cast<int>(kConnectionsOfElement),
              std::vector<double>(kConnectionsOfElement * body.element_count(), 0)};
  return column;
}

}  // namespace

bool Edit::changes_elements_only() const {
  return density_ != 1 || yield_ != 1 || radius_ != 1 || stick_ != 0;
}

Edit Edit::parse(TableReader& reader) {
  Edit made;
  made.region_ = parse_region(reader);
  if (const std::optional<std::string> of = reader.text("connections")) {
    if (*of != "inside" && *of != "across")
      reader.fail(reader.find("connections")->line,
                  fmt::format("\"connections\" = \"{}\"; choose \"inside\" or \"across\"", *of));
    made.of_ = *of == "inside" ? Of::connections_inside : Of::connections_across;
  }
  made.length_ = factor(reader, "length");
  made.stiffness_ = factor(reader, "stiffness");
  made.damping_ = factor(reader, "damping");
  made.density_ = factor(reader, "density");
  made.strength_ = factor(reader, "strength");
  made.yield_ = factor(reader, "yield");
  made.friction_ = factor(reader, "friction");
  made.radius_ = factor(reader, "radius");
  made.stick_ = reader.quantity("stick", Dimension::pressure).value_or(0);
  made.origin_ = reader.place();
  if (made.of_ != Of::elements && reader.find("every"))
    reader.fail(reader.find("every")->line, "connections are edited once: leave \"every\" out");
  if (made.of_ == Of::elements && made.length_ != 1)
    reader.fail("\"length\" is that of connections: give \"connections\" = \"inside\" or \"across\" too");
  if (made.of_ != Of::elements && made.changes_elements_only())
    reader.fail(
        "connections have no density, yield, radius or stick of their own: leave \"connections\" out for "
        "these");
  if (made.length_ == 1 && made.stiffness_ == 1 && made.damping_ == 1 && made.density_ == 1 &&
      made.strength_ == 1 && made.yield_ == 1 && made.friction_ == 1 && made.radius_ == 1 && made.stick_ == 0)
    reader.fail(
        "edit needs \"stiffness\", \"damping\", \"density\", \"strength\", \"yield\", \"friction\" or "
        "\"radius\", factors on what there is, for example stiffness = 2, or \"stick\", a traction more");
  return made;
}

// With both ends in the region, or with one.
std::string Edit::edit_connections(EventContext& context, const Chosen& chosen) const {
  const Connections connections = make_connections(context.problem);
  std::vector<std::size_t> edited;
  for (std::size_t c = 0; c < connections.size(); ++c) {
    const int inside = chosen.elements[connections.a[c]] + chosen.elements[connections.b[c]];
    if (inside == (of_ == Of::connections_inside ? 2 : 1)) edited.push_back(c);
  }
  if (edited.empty())
    throw InputError(origin_, fmt::format("edit: no connection of model \"paper\" is {} {}",
                                          of_ == Of::connections_inside ? "inside" : "across the border of",
                                          describe(region_)));
  const auto place = [&](std::size_t c) {
    return kConnectionsOfElement * connections.a[c] + connections.kind[c] - std::size_t{1};
  };
  std::string factors;
  for (const auto& [called, column, by] : {std::tuple{"stiffness", "connection_stiffness_change", stiffness_},
                                           {"damping", "connection_damping_change", damping_},
                                           {"strength", "connection_strength_change", strength_},
                                           {"friction", "connection_friction_change", friction_}}) {
    if (by == 1) continue;
    std::vector<double>& values = connection_column(context.body, column).values;
    for (const std::size_t c : edited) values[place(c)] = (1 + values[place(c)]) * by - 1;
    append_text(factors, ", {} times {}", called, by);
  }
  if (length_ != 1) {
    const std::vector<std::uint32_t> part = element_parts(context.body);
    std::vector<double>& values = connection_column(context.body, "connection_rest").values;
    for (const std::size_t c : edited) {
      const double lattice = connections.parts[part[connections.a[c]]].kinds[connections.kind[c]].length;
      values[place(c)] = length_ * (lattice + values[place(c)]) - lattice;
    }
    append_text(factors, ", length times {}", length_);
  }
  return fmt::format("{} connections {} {}:{}", edited.size(),
                     of_ == Of::connections_inside ? "inside" : "across the border of", describe(region_),
                     factors.substr(1));
}

std::string Edit::apply(EventContext& context) const {
  EditedAlready edited(context, origin_);  // a tool may pass twice
  Chosen chosen = choose(region_, context.body, context.state);
  if (of_ != Of::elements) return edit_connections(context, chosen);
  const bool at_corners = friction_ != 1 || stick_ != 0 || radius_ != 1;
  if (!holds_any(context.body, chosen, at_corners))
    throw EmptySelectionError(
        origin_,
        fmt::format("edit: no cell has more than half of its elements in {}: take a larger region, or "
                    "smaller cells",
                    describe(region_)));
  edited.leave_out(chosen);
  if (!holds_any(context.body, chosen, at_corners))
    throw EmptySelectionError(origin_, fmt::format("all of {} was edited already", describe(region_)));
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
