// Reads the file before the run; joins its body to the others.
#include "simulate/events/add.h"

#include <fmt/format.h>

#include <filesystem>

#include "formats/body_file.h"
#include "formats/error.h"
#include "simulate/merge.h"
#include "simulate/rest_shape.h"
#include "simulate/time/act.h"

namespace flexel {
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
  const SceneValue& body = reader.require("body", "\"ball.vtu\"");
  const std::string path = body.kind == SceneValue::Kind::string ? body.text : "";
  if (path.empty()) reader.fail(body.line, "\"body\" needs the name of a body's file");
  // beside the scene
  made.path_ = (std::filesystem::path(reader.file()).parent_path() / path).string();
  made.velocity_ = reader.vector("velocity", Dimension::velocity);
  return made;
}

std::vector<std::string> Add::prepare() {
  try {
    body_ = read_body(path_);
  } catch (const InputError& error) {
    throw InputError(origin_,
                     "\"body\" " + (error.where().empty() ? path_ : error.where()) + ": " + error.what());
  }
  std::vector<std::string> names;
  for (const Part& part : body_.parts) names.push_back(part.name);
  return names;
}

std::string Add::happen(Stage& stage) const {
  Body other = body_;
  State state = beginning(other);
  if (velocity_) state.velocity.assign(other.element_count(), *velocity_);
  const std::vector<Vec3> settled = settled_displacement(other);
  if (!stage.settled.empty() || !settled.empty()) {
    stage.settled.resize(stage.body.element_count(), Vec3::Zero());
    stage.settled.insert(stage.settled.end(), settled.begin(), settled.end());
    stage.settled.resize(stage.body.element_count() + other.element_count(), Vec3::Zero());
  }
  level(other.element_columns, other.element_count(), stage.body.element_columns);
  level(stage.body.element_columns, stage.body.element_count(), other.element_columns);
  level(other.cell_columns, other.cell_count(), stage.body.cell_columns);
  level(stage.body.cell_columns, stage.body.cell_count(), other.cell_columns);
  const std::size_t parts = other.parts.size();
  append(stage.body, std::move(other));
  stage.state.displacement.insert(stage.state.displacement.end(), state.displacement.begin(),
                                  state.displacement.end());
  stage.state.velocity.insert(stage.state.velocity.end(), state.velocity.begin(), state.velocity.end());
  return fmt::format("{} part(s) of {} joined", parts, path_);
}

}  // namespace flexel
