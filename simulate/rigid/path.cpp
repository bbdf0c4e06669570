// Keys of a path, its table, and where it is at a time.
#include "simulate/rigid/path.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/files/files.h"
#include "base/number_range.h"

namespace flexel::simulate {
namespace {

Vec3 parse_turn(const SceneValue& value, const TableReader& parent) {
  TableReader reader(value, parent.file(), "rotation of [[manipulator]]");
  (void)reader.require("axis", "[0, 0, 1]");
  const Vec3 axis = *reader.direction("axis");
  const double angle = reader.to_quantity(reader.require("angle", "\"30 deg\""), Dimension::angle, "angle");
  reader.finish();
  return angle * axis;
}

void check_path(const ManipulatorPath& path, const std::string& place) {
  for (std::size_t i = 1; i < path.time.size(); ++i)
    if (!(path.time[i] > path.time[i - 1])) throw InputError(place, "the times of a path need to ascend");
}

const SceneValue* list(TableReader& reader, const char* key, std::size_t count) {
  const SceneValue* value = reader.find(key);
  if (value && (value->kind != SceneValue::Kind::array || value->items.size() != count))
    reader.fail(value->line, fmt::format("\"{}\" needs as many entries as \"time\", {}", key, count));
  return value;
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r"), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(trimmed(field));
  return fields;
}

struct PathColumn {
  int place = 0;      // 0: time, 1 to 3: x, y, z, 4 to 6: rx, ry, rz
  double factor = 1;  // to SI
};

PathColumn parse_column(const std::string& header, const std::string& place) {
  static constexpr std::array<const char*, 7> kNames = {"time", "x", "y", "z", "rx", "ry", "rz"};
  const std::size_t bracket = header.find('[');
  const std::string name = trimmed(header.substr(0, bracket));
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end() || bracket == std::string::npos || header.back() != ']')
    throw InputError(place,
                     fmt::format("\"{}\" is no column of a path; they are \"time [s]\", \"x [mm]\", \"y "
                                 "[mm]\", \"z [mm]\", and \"rx [deg]\", \"ry [deg]\", \"rz [deg]\"",
                                 header));
  PathColumn column;
  column.place = static_cast<int>(found - kNames.begin());
  const Dimension dimension = column.place == 0   ? Dimension::time
                              : column.place <= 3 ? Dimension::length
                                                  : Dimension::angle;
  try {
    column.factor = parse_quantity("1 " + header.substr(bracket + 1, header.size() - bracket - 2), dimension);
  } catch (const InputError& error) {
    throw InputError(place, fmt::format("column \"{}\": {}", header, error.what()));
  }
  return column;
}

}  // namespace

ManipulatorPath::Key ManipulatorPath::key(double when) const {
  if (time.empty()) return {};
  const auto next = std::upper_bound(time.begin(), time.end(), when);
  if (next == time.begin()) return {displacement.front(), turn.front()};
  if (next == time.end()) return {displacement.back(), turn.back()};
  const auto i = static_cast<std::size_t>(next - time.begin());
  const double share = (when - time[i - 1]) / (time[i] - time[i - 1]);
  const Vec3 moved = displacement[i - 1] + share * (displacement[i] - displacement[i - 1]);
  // about one axis the whole way, also through more than half a turn; else the shortest way
  if (turn[i].cross(turn[i - 1]).norm() <= 1e-12 * turn[i].norm() * turn[i - 1].norm())
    return {moved, turn[i - 1] + share * (turn[i] - turn[i - 1])};
  const Mat3 before = turned_by(turn[i - 1]);
  const Vec3 between = turn_of(turned_by(turn[i]) * before.transpose());
  return {moved, turn_of(turned_by(share * between) * before)};
}

Pose ManipulatorPath::at(double when, const Vec3& centre) const {
  const Key here = key(when);
  Pose pose;
  pose.rotation = turned_by(here.turn);
  const Vec3 pivot = about.value_or(centre);
  pose.translation = here.displacement + (pose.rotation - Mat3::Identity()) * (centre - pivot);
  return pose;
}

ManipulatorPath read_path(const std::string& text, const std::string& name) {
  std::istringstream in(text);
  std::string line;
  std::vector<PathColumn> columns;
  std::array<bool, 7> present{};
  ManipulatorPath path;
  for (int number = 1; std::getline(in, line); ++number) {
    if (trimmed(line).empty()) continue;
    const std::string place = fmt::format("{}:{}", name, number);
    const std::vector<std::string> fields = fields_of(line);
    if (columns.empty()) {
      for (const std::string& header : fields) {
        columns.push_back(parse_column(header, place));
        if (std::exchange(present[static_cast<std::size_t>(columns.back().place)], true))
          throw InputError(place, fmt::format("column \"{}\" is there twice", header));
      }
      if (!present[0]) throw InputError(place, "a path needs the column \"time [s]\"");
      continue;
    }
    if (fields.size() != columns.size())
      throw InputError(place, fmt::format("{} numbers, but {} columns", fields.size(), columns.size()));
    std::array<double, 7> values{};
    for (std::size_t f = 0; f < fields.size(); ++f) {
      double value = 0;
      const char* end = fields[f].data() + fields[f].size();
      const auto [stop, error] = std::from_chars(fields[f].data(), end, value);
      if (error != std::errc() || stop != end || !is_readable_number(value * columns[f].factor))
        throw InputError(place,
                         fmt::format("\"{}\" is no finite number of at most 1e35 in SI units", fields[f]));
      values[static_cast<std::size_t>(columns[f].place)] = value * columns[f].factor;
    }
    path.time.push_back(values[0]);
    path.displacement.emplace_back(values[1], values[2], values[3]);
    path.turn.emplace_back(values[4], values[5], values[6]);
    if (path.time.size() > 1 && !(values[0] > path.time[path.time.size() - 2]))
      throw InputError(place, "the times of a path need to ascend");
  }
  if (path.time.empty()) throw InputError(name, "no row of a path in it");
  return path;
}

ManipulatorPath parse_path(TableReader& reader) {
  ManipulatorPath path;
  const std::optional<Vec3> about = reader.vector("about", Dimension::length);
  if (const std::optional<std::string> file = reader.text("path")) {
    for (const char* key : {"time", "displacement", "rotation"})
      if (reader.find(key))
        reader.fail(reader.find(key)->line,
                    fmt::format("\"{}\" beside \"path\": the file has them all", key));
    path.about = about;
    if (*file == "stdin") return path;
    // beside the scene, unless it says otherwise
    std::filesystem::path where(*file);
    if (where.is_relative() && reader.file() != "stdin")
      where = std::filesystem::path(reader.file()).parent_path() / where;
    const Bytes bytes = read_all(where.string());
    path = read_path(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), where.string());
  } else if (const SceneValue* times = reader.find("time")) {
    if (times->kind != SceneValue::Kind::array || times->items.empty())
      reader.fail(times->line, "\"time\" needs a list, for example [\"0 s\", \"0.1 s\"]");
    const std::size_t count = times->items.size();
    const SceneValue* moves = list(reader, "displacement", count);
    const SceneValue* turns = list(reader, "rotation", count);
    if (!moves && !turns)
      reader.fail(times->line, "a path with \"time\" needs \"displacement\" or \"rotation\" too");
    for (std::size_t i = 0; i < count; ++i) {
      path.time.push_back(reader.to_quantity(times->items[i], Dimension::time, "time"));
      path.displacement.push_back(moves ? reader.to_vector(moves->items[i], Dimension::length, "displacement")
                                        : Vec3::Zero());
      path.turn.push_back(turns ? parse_turn(turns->items[i], reader) : Vec3::Zero());
    }
    check_path(path, reader.place(times->line));
  } else {
    for (const char* key : {"displacement", "rotation"})
      if (reader.find(key))
        reader.fail(reader.find(key)->line, fmt::format("\"{}\" needs \"time\" too", key));
  }
  path.about = about;
  return path;
}

}  // namespace flexel::simulate
