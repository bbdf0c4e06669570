// What scenes know: flexel scene-keys, every key, from the lists that the program reads scenes with; flexel materials, the
// library.
#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/program/arguments.h"
#include "flexel/commands.h"
#include "flexel/measure/materials_table.h"
#include "simulate/scene/scene_keys.h"

namespace flexel::commands {
namespace {

std::string place_of(const simulate::SceneKey& key) {
  return key.table.empty() ? "top" : key.table;
}

std::string as_text() {
  std::string text;
  for (const simulate::SceneKeyGroup& group : simulate::scene_key_groups()) {
    text += fmt::format("{}{}: {}", text.empty() ? "" : "\n", group.name, group.help);
    if (!group.acts.empty()) text += fmt::format(" ({})", group.acts);
    text += "\n";
    for (const simulate::SceneKey& key : group.keys)
      text += fmt::format("  {:<24} {:<18} {:<24} {}{}\n", place_of(key), key.key, value_of(key), key.help,
                          key.standard.empty() ? "" : fmt::format(" [{}]", key.standard));
  }
  return text;
}

std::string as_markdown() {
  std::string text;
  for (const simulate::SceneKeyGroup& group : simulate::scene_key_groups()) {
    text += fmt::format("{}## {}\n\n{}.", text.empty() ? "" : "\n", group.name, group.help);
    if (!group.acts.empty()) text += fmt::format(" Acts in: {}.", group.acts);
    if (!group.models.empty()) text += fmt::format(" Models: {}.", group.models);
    text += "\n\n| table | key | value | default | what |\n|---|---|---|---|---|\n";
    for (const simulate::SceneKey& key : group.keys)
      text += fmt::format("| {} | `{}` | {} | {} | {} |\n",
                          key.table.empty() ? "top" : fmt::format("`{}`", key.table), key.key, value_of(key),
                          key.standard, key.help);
  }
  return text;
}

// What an editor or `complete -W "$(flexel scene-keys --words)"` of bash offers: tables, then keys.
std::string as_words() {
  std::vector<std::string> tables, keys;
  const auto add = [](std::vector<std::string>& words, const std::string& word) {
    if (std::find(words.begin(), words.end(), word) == words.end()) words.push_back(word);
  };
  for (const simulate::SceneKeyGroup& group : simulate::scene_key_groups())
    for (const simulate::SceneKey& key : group.keys) {
      if (key.table.starts_with("[")) add(tables, key.table);
      add(keys, key.key);
    }
  return fmt::format("{}\n{}\n", fmt::join(tables, "\n"), fmt::join(keys, "\n"));
}

std::string as_json() {
  nlohmann::ordered_json groups = nlohmann::ordered_json::array();
  for (const simulate::SceneKeyGroup& group : simulate::scene_key_groups()) {
    nlohmann::ordered_json keys = nlohmann::ordered_json::array();
    for (const simulate::SceneKey& key : group.keys)
      keys.push_back({{"table", key.table},
                      {"key", key.key},
                      {"value", value_of(key)},
                      {"default", key.standard},
                      {"help", key.help}});
    groups.push_back({{"name", group.name},
                      {"help", group.help},
                      {"acts", group.acts},
                      {"models", group.models},
                      {"keys", std::move(keys)}});
  }
  return json_text({{"groups", std::move(groups)}}, 2) + "\n";
}

}  // namespace

int scene_keys_command(int argc, char** argv) {
  bool markdown = false, words = false, json = false;
  CommandLine app{"Lists the keys of a scene: where each may stand, what it takes, its default.",
                  "flexel scene-keys"};
  const Option as_page = app.add_flag("--markdown", markdown, "As tables in Markdown");
  const Option as_list =
      app.add_flag("--words", words, "Tables and keys alone, a line each, for completion").excludes(as_page);
  app.add_flag("--json", json, "As JSON (docs/reference/json.md)").excludes(as_page).excludes(as_list);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  OutputFile out("-", false);
  out.write(json ? as_json() : words ? as_words() : markdown ? as_markdown() : as_text());
  out.commit();
  return kExitDone;
}

int materials_command(int argc, char** argv) {
  bool json = false, markdown = false, words = false;
  CommandLine app{"Lists the materials that scenes and --material know, each figure with its source.",
                  "flexel materials"};
  const Option as_json = app.add_flag("--json", json, "As JSON, in SI units");
  const Option as_page = app.add_flag("--markdown", markdown, "As a table in Markdown").excludes(as_json);
  app.add_flag("--words", words, "The names alone, a line each, for completion")
      .excludes(as_json)
      .excludes(as_page);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  OutputFile out("-", false);
  out.write(json       ? materials_json()
            : markdown ? materials_markdown()
            : words    ? materials_words()
                       : materials_text());
  out.commit();
  return kExitDone;
}

}  // namespace flexel::commands
