// The fields of the state go with the lattice; what else the body remembers is refused.
#include "simulate/events/resolution.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/resources.h"
#include "base/units.h"
#include "simulate/matter/stress.h"
#include "simulate/result/memory_limit.h"

namespace flexel::simulate {
namespace {

constexpr const char *kSettledColumn = "settled", *kVelocityColumn = "velocity";

// Columns and notes whose values belong to places of one lattice, or may do so.
void refuse_memory_of_places(const Body& body) {
  for (const Columns* columns : {&body.element_columns, &body.cell_columns})
    for (const auto& [name, column] : *columns)
      if (name != kSettledColumn && name != kVelocityColumn && !is_stress_column(name))
        throw InputError(
            fmt::format("the body has \"{}\", of an earlier run or event, which has no place on "
                        "another lattice",
                        name));
  for (const char* note : {"carved", "stuck", "fused", "joined"})
    if (body.notes.contains(note))
      throw InputError(
          fmt::format("the body's note \"{}\", of an earlier run or event, names places of its "
                      "lattice, which another one does not have",
                      note));
}

// At four cells across a bar of springs is some per cent stiffer than at eight, and its energy changes with
// that.
void refuse_springs(const Problem& problem, const std::vector<std::uint8_t>& changed) {
  for (std::size_t p = 0; p < problem.models.size(); ++p)
    if (changed[p] && problem.models[p] == Model::springs)
      throw InputError(
          fmt::format("part \"{}\" is of model \"springs\", which resists differently on another "
                      "lattice; use model \"cells\"",
                      problem.body.parts[p].name));
}

std::size_t count_elements(const Body& body, const std::vector<std::uint8_t>& changed) {
  std::size_t count = 0;
  for (std::size_t p = 0; p < body.parts.size(); ++p)
    if (changed[p]) count += body.parts[p].element_end - body.parts[p].element_begin;
  return count;
}

// Before the run. A part with c cells gets more than 8 c elements.
void refuse_beyond_memory_if_finer(const Body& body, const std::vector<std::uint8_t>& changed,
                                   const std::string& origin) {
  std::size_t elements = 0;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    elements +=
        changed[p] ? 8 * std::size_t{part.cell_end - part.cell_begin} : part.element_end - part.element_begin;
  }
  check_elements(static_cast<double>(elements), origin);
  refuse_beyond_memory(moving_memory(static_cast<double>(elements)), human_count(elements) + " elements",
                       origin);
}

Column vector_column(const std::vector<Vec3>& values) {
  Column column;
  column.components = 3;
  for (const Vec3& each : values) column.values.insert(column.values.end(), each.begin(), each.end());
  return column;
}

}  // namespace

ResolutionEvent ResolutionEvent::parse(TableReader& reader) {
  ResolutionEvent made;
  made.origin_ = reader.place();
  for (const char* key : {"every", "until", "where", "with", "positions"})
    if (const SceneValue* given = reader.find(key))
      reader.fail(given->line,
                  fmt::format("resolution changes once, of a whole \"part\": leave \"{}\" out", key));
  const SceneValue& given = reader.require("change", "\"finer\"");
  const std::string to = reader.text("change").value_or("");
  if (to != "finer" && to != "coarser")
    reader.fail(given.line, fmt::format("\"change\" = \"{}\"; choose \"finer\" or \"coarser\"", to));
  made.to_ = to == "finer" ? ResolutionChange::finer : ResolutionChange::coarser;
  made.part_ = reader.text("part").value_or("");
  return made;
}

std::vector<std::uint8_t> ResolutionEvent::changed_parts(const Body& body) const {
  std::vector<std::uint8_t> changed(body.parts.size(), part_.empty() && !number_);
  if (number_) {
    changed.at(*number_) = 1;
    return changed;
  }
  std::vector<std::string> names;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    names.push_back(body.parts[p].name);
    if (names.back() == part_) changed[p] = 1;
  }
  if (std::find(changed.begin(), changed.end(), 1) == changed.end())
    throw InputError(fmt::format("no part is called \"{}\"{}", part_, did_you_mean(part_, names)));
  return changed;
}

std::string ResolutionEvent::apply(EventContext& context) const try {
  if (!context.problem.duration)
    throw InputError("it changes in timed runs: give [run] time = \"1 s\", or leave the event out");
  Body& body = context.body;
  State& state = context.state;
  refuse_memory_of_places(body);
  if (!context.fused.empty()) throw InputError("an earlier run or an event fused points of the body");
  const std::vector<std::uint8_t> parts = changed_parts(body);
  refuse_springs(context.problem, parts);
  if (to_ == ResolutionChange::finer && !state.time) refuse_beyond_memory_if_finer(body, parts, origin_);
  std::vector<std::vector<Vec3>> fields{state.displacement, state.velocity};
  if (!context.settled.empty()) fields.push_back(context.settled);
  Body made = at_resolution(body, parts, to_, fields);
  if (!state.time) check_elements(static_cast<double>(made.element_count()), origin_);
  const std::string& changed = number_ ? body.parts[*number_].name : part_;
  std::string told = fmt::format("{}: {} elements became {}",
                                 changed.empty() ? "every part" : fmt::format("part \"{}\"", changed),
                                 count_elements(body, parts), count_elements(made, parts));
  if (!why_.empty()) told += fmt::format(", for {}", why_);
  state.displacement = std::move(fields[0]);
  state.velocity = std::move(fields[1]);
  if (!context.settled.empty()) context.settled = std::move(fields[2]);
  if (body.element_columns.contains(kSettledColumn))
    made.element_columns[kSettledColumn] = vector_column(context.settled);
  for (std::size_t e = 0; e < made.element_count(); ++e)
    made.position.push_back(made.rest[e] + state.displacement[e]);
  made.surface = std::move(body.surface);
  made.notes = std::move(body.notes);
  body = std::move(made);
  return told;
} catch (const InputError& error) {
  throw InputError(origin_, fmt::format("resolution: {}", error.what()));
}

}  // namespace flexel::simulate
