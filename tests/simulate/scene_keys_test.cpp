// The list of keys and what reads them are one.
#include "simulate/scene/scene_keys.h"

#include <gmock/gmock.h>

#include <set>

#include "base/error.h"
#include "simulate/scene/effects.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

std::string refused(const std::string& text) {
  try {
    (void)parse_scene(text, "s.toml");
  } catch (const InputError& error) {
    return error.where() + ": " + error.what();
  }
  return "";
}

TEST(SceneKeys, EachStandsOnceAndSaysWhatItTakes) {
  std::set<std::pair<std::string, std::string>> seen;
  for (const SceneKeyGroup& group : scene_key_groups())
    for (const SceneKey& key : group.keys) {
      EXPECT_TRUE(seen.insert({key.table, key.key}).second) << key.table << " " << key.key;
      EXPECT_FALSE(key.help.empty()) << key.key;
      // A unit of the library, or an example with one
      EXPECT_TRUE(key.kind != KeyKind::quantity || key.unit || key.help.find('"') != std::string::npos)
          << key.key;
    }
  EXPECT_TRUE(seen.contains({"[contact]", "overlap_time"}));
}

// A table of the list with one key of another name is refused with the list's own keys.
TEST(SceneKeys, AnUnknownKeyIsToldTheNearestOfTheList) {
  EXPECT_THAT(refused("[gravty]\n"),
              HasSubstr("s.toml:1: unknown key \"gravty\" in the scene; did you mean \"gravity\"?"));
  for (const SceneKeyGroup& group : scene_key_groups())
    for (const SceneKey& key : group.keys) {
      if (!key.table.starts_with("[")) continue;
      std::string table = key.table;
      if (const std::size_t name = table.find("NAME"); name != std::string::npos)
        table.replace(name, 4, "gum");
      EXPECT_THAT(refused(table + "\n" + key.key + "q = 1\n"),
                  HasSubstr("s.toml:2: unknown key \"" + key.key + "q\" in " + table + "; did you mean \""))
          << key.key;
    }
}

// A key that the list has and nothing reads is refused by the reader.
TEST(SceneKeys, EveryKeyOfTheListIsRead) {
  for (const SceneKeyGroup& group : scene_key_groups())
    for (const SceneKey& key : group.keys) {
      if (!key.table.starts_with("[")) continue;
      std::string table = key.table;
      if (const std::size_t name = table.find("NAME"); name != std::string::npos)
        table.replace(name, 4, "gum");
      // "path" alone would pass for a mistyped "part", which is required
      const std::string part = key.key == "path" ? "part = \"tool\"\n" : "";
      const std::string message = refused(table + "\n" + key.key + " = 1\n" + part);
      EXPECT_EQ(message.find("unknown key"), std::string::npos) << message;
    }
}

TEST(SceneKeys, RowsAreNamedOnce) {
  std::set<std::string> names;
  for (const EffectRow& row : effect_rows()) EXPECT_TRUE(names.insert(row.name).second) << row.name;
  EXPECT_EQ(names.size(), effect_rows().size());
}

}  // namespace
}  // namespace flexel::simulate
