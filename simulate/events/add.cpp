// Reads the file before the run; joins its body to the others.
#include "simulate/events/add.h"

#include <fmt/format.h>

#include <filesystem>

#include "base/error.h"
#include "base/files/named_file.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/merge.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

// Columns of zeros in `columns` for those that only `others` has.
void level(Columns& columns, std::size_t count, const Columns& others) {
  for (const auto& [name, column] : others)
    if (!columns.contains(name))
      columns[name] = {column.components,
                       std::vector<double>(count * static_cast<std::size_t>(column.components), 0)};
}

}  // namespace

Add Add::parse(TableReader& reader) {
  Add made;
  made.origin_ = reader.place();
  for (const char* key : {"every", "with"})
    if (const SceneValue* given = reader.find(key))
      reader.fail(given->line, fmt::format("a body is added once, where it is: leave \"{}\" out", key));
  const SceneValue& body = reader.require("body", "\"ball.vtu\"");
  const std::string path = body.kind == SceneValue::Kind::string ? body.text : "";
  if (path.empty()) reader.fail(body.line, "\"body\" needs the name of a body's file");
  // beside the scene
  made.path_ = (std::filesystem::path(reader.file()).parent_path() / path).string();
  made.velocity_ = reader.vector("velocity", Dimension::velocity);
  return made;
}

std::vector<std::string> Add::prepare() {
  refuse_device(path_, origin_);
  try {
    body_ = read_body(path_);
    refuse_damaged_columns(body_);
  } catch (const InputError& error) {
    throw InputError(origin_,
                     "\"body\" " + (error.where().empty() ? path_ : error.where()) + ": " + error.what());
  }
  std::vector<std::string> names;
  for (const Part& part : body_.parts) names.push_back(part.name);
  return names;
}

std::string Add::apply(EventContext& context) const {
  if (velocity_ && !context.problem.duration)
    throw InputError(origin_,
                     "add: \"velocity\" is of timed runs: give [run] time = \"1 s\", or leave it out");
  Body other = body_;
  State state = state_of(other);
  if (velocity_) state.velocity.assign(other.element_count(), *velocity_);
  const std::vector<Vec3> settled = settled_displacement(other);
  if (!context.settled.empty() || !settled.empty()) {
    context.settled.resize(context.body.element_count(), Vec3::Zero());
    context.settled.insert(context.settled.end(), settled.begin(), settled.end());
    context.settled.resize(context.body.element_count() + other.element_count(), Vec3::Zero());
  }
  level(other.element_columns, other.element_count(), context.body.element_columns);
  level(context.body.element_columns, context.body.element_count(), other.element_columns);
  level(other.cell_columns, other.cell_count(), context.body.cell_columns);
  level(context.body.cell_columns, context.body.cell_count(), other.cell_columns);
  const std::size_t parts = other.parts.size();
  for (FusedPoint& point : fused_points(other)) {
    for (std::uint32_t& e : point.elements) e += static_cast<std::uint32_t>(context.body.element_count());
    context.fused.push_back(std::move(point));
  }
  other.notes.erase(kFusedNote);
  append(context.body, std::move(other));
  context.state.displacement.insert(context.state.displacement.end(), state.displacement.begin(),
                                    state.displacement.end());
  context.state.velocity.insert(context.state.velocity.end(), state.velocity.begin(), state.velocity.end());
  return fmt::format("{} part(s) of {} joined", parts, path_);
}

}  // namespace flexel::simulate
