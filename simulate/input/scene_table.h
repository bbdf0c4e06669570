// A scene file as a tree of plain values with their lines, and the reader that every part of a scene is
// parsed with. Nothing here sees toml++: scene_table_toml.cpp turns its tables into this tree.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/math/vec.h"
#include "base/units.h"

namespace flexel::simulate {

struct SceneMember;

struct SceneValue {
  enum class Kind { string, number, boolean, array, table, other };
  Kind kind = Kind::other;
  std::string text;                  // of a string
  double number = 0;                 // of an integer or a float
  bool flag = false;                 // of a boolean
  std::vector<SceneValue> items;     // of an array
  std::vector<SceneMember> members;  // of a table, in order of the file
  int line = 0;                      // where it begins; 0: not from a file
};

struct SceneMember {
  std::string key;
  SceneValue value;
};

// Parses TOML. `name` is the file's name for messages. Throws InputError("name:line", ...) for wrong TOML.
[[nodiscard]] SceneValue read_toml(const std::string& text, const std::string& name);

[[nodiscard]] const char* kind_name(SceneValue::Kind kind);

// Reads one table key by key. Every key that is asked for is known from then on; finish() refuses the others
// with the nearest known one. All values in SI. A key that is absent gives nothing; a value of a wrong kind,
// a number without a unit where one is needed or a unit of another dimension is an InputError with the line.
class TableReader {
 public:
  // `title` is what the table is called in messages: "[[load]]", "[materials.gum]".
  TableReader(const SceneValue& table, std::string file, std::string title);

  [[nodiscard]] const SceneValue* find(const std::string& key);
  [[nodiscard]] std::optional<std::string> text(const std::string& key);
  [[nodiscard]] std::optional<double> number(const std::string& key);  // a bare number
  [[nodiscard]] std::optional<double> quantity(const std::string& key, Dimension dimension);
  [[nodiscard]] std::optional<Vec3> vector(const std::string& key,
                                           Dimension dimension);        // ["1 mm", "0 mm", "2 mm"]
  [[nodiscard]] std::optional<Vec3> direction(const std::string& key);  // [0, 0, 1], made a unit vector
  // The tables of [[key]], or the one of [key].
  [[nodiscard]] std::vector<const SceneValue*> tables(const std::string& key);
  // As above, but a missing key is an error that shows `example`.
  [[nodiscard]] const SceneValue& require(const std::string& key, const std::string& example);

  // Converts a value that was found.
  [[nodiscard]] double to_quantity(const SceneValue& value, Dimension dimension,
                                   const std::string& key) const;
  [[nodiscard]] Vec3 to_vector(const SceneValue& value, Dimension dimension, const std::string& key) const;

  void finish() const;  // throws InputError for the first key that nobody asked for
  [[noreturn]] void fail(const std::string& what) const { fail(table_->line, what); }
  [[noreturn]] void fail(int line, const std::string& what) const;
  [[nodiscard]] std::string place(int line) const;  // "beam.toml:12"
  [[nodiscard]] std::string place() const { return place(table_->line); }
  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] const SceneValue& table() const { return *table_; }

 private:
  const SceneValue* table_;
  std::string file_, title_;
  std::vector<std::string> known_;
};

}  // namespace flexel::simulate
