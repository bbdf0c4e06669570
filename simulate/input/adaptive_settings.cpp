// Keys and their bounds.
#include "simulate/input/adaptive_settings.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace flexel::simulate {
namespace {

constexpr int kMostLevels = 4;

double above_0(TableReader& reader, const char* key, double fallback, double most) {
  const double value = reader.number(key).value_or(fallback);
  if (!(value > 0 && value <= most))
    reader.fail(reader.find(key)->line,
                fmt::format("\"{}\" needs to be above 0{}", key,
                            std::isfinite(most) ? fmt::format(" and at most {}", most) : ""));
  return value;
}

int level(TableReader& reader, const char* key, int fallback) {
  const double value = reader.number(key).value_or(fallback);
  if (!(value >= 0 && value <= kMostLevels && value == std::floor(value)))
    reader.fail(reader.find(key)->line,
                fmt::format("\"{}\" needs to be a whole number from 0 to {}", key, kMostLevels));
  return static_cast<int>(value);
}

std::optional<std::vector<std::string>> part_list(TableReader& reader) {
  const SceneValue* value = reader.find("parts");
  if (!value || (value->kind == SceneValue::Kind::string && value->text == "all")) return std::nullopt;
  std::vector<std::string> names;
  for (const SceneValue& item : value->items)
    if (item.kind == SceneValue::Kind::string) names.push_back(item.text);
  if (value->kind != SceneValue::Kind::array || names.empty() || names.size() != value->items.size())
    reader.fail(value->line,
                "\"parts\" needs to be \"all\" or a list of names, for example [\"bar\", \"block\"]");
  return names;
}

AdaptiveSettings parse_settings(TableReader& reader) {
  AdaptiveSettings made;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  made.parts = part_list(reader);
  made.strain_jump = above_0(reader, "strain_jump", made.strain_jump, kInfinity);
  made.calm = above_0(reader, "calm", made.calm, 0.5);
  if (const SceneValue* contact = reader.find("contact")) {
    if (contact->kind != SceneValue::Kind::boolean)
      reader.fail(contact->line, "\"contact\" needs to be true or false");
    made.contact = contact->flag;
  }
  made.least_time = reader.quantity("least_time", Dimension::time);
  if (made.least_time && !(*made.least_time > 0))
    reader.fail(reader.find("least_time")->line, "\"least_time\" needs to be above 0");
  made.finest = level(reader, "finest", made.finest);
  made.coarsest = level(reader, "coarsest", made.coarsest);
  if (made.finest == 0 && made.coarsest == 0)
    reader.fail("\"finest\" and \"coarsest\" are both 0: nothing could change; give one of them");
  made.most_elements = reader.number("max_elements");
  if (made.most_elements && !(*made.most_elements >= 1))
    reader.fail(reader.find("max_elements")->line, "\"max_elements\" needs to be 1 or more");
  reader.finish();
  return made;
}

}  // namespace

std::optional<AdaptiveSettings> parse_adaptive(TableReader& root, TableReader& run) {
  const std::string how = run.text("resolution").value_or("fixed");
  const SceneValue* table = root.find("adaptive");
  if (how != "fixed" && how != "adaptive")
    run.fail(run.find("resolution")->line,
             fmt::format("\"resolution\" = \"{}\"; choose \"fixed\" or \"adaptive\"", how));
  if (how == "fixed") {
    if (table) root.fail(table->line, "[adaptive] needs resolution = \"adaptive\" in [run]");
    return std::nullopt;
  }
  if (!run.find("time"))
    run.fail(run.find("resolution")->line,
             "\"resolution\" = \"adaptive\" is for timed runs: give time = \"1 s\", or leave it out");
  SceneValue empty;
  empty.kind = SceneValue::Kind::table;
  empty.line = run.find("resolution")->line;
  TableReader reader(table ? *table : empty, root.file(), "[adaptive]");
  AdaptiveSettings made = parse_settings(reader);
  made.origin = reader.place();
  return made;
}

}  // namespace flexel::simulate
