// Words to numbers, and the turns of quaternions.
#include "simulate/rigid/pose_line.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/error.h"
#include "base/number_range.h"
#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {
namespace {

constexpr const char* kBlank = " \t\r,";

std::vector<std::string> words_in(const std::string& line) {
  std::vector<std::string> words;
  for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string::npos;) {
    const std::size_t end = line.find_first_of(kBlank, begin);
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlank, end);
  }
  return words;
}

std::optional<double> number_of(const std::string& word) {
  double value = 0;
  const char* end = word.data() + word.size();
  const char* begin = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !is_readable_number(value)) return std::nullopt;
  return value;
}

}  // namespace

std::optional<PoseLine> parse_pose_line(const std::string& line, const std::string& place) {
  std::vector<std::string> words = words_in(line);
  if (words.empty() || words.front().front() == '#') return std::nullopt;
  PoseLine pose;
  if (words.size() == 1 && words.front() == "end") {
    pose.end = true;
    return pose;
  }
  if (!number_of(words.front())) {
    pose.tool = words.front();
    words.erase(words.begin());
  }
  if (words.size() != 4 && words.size() != 7 && words.size() != 8)
    throw InputError(place, fmt::format("{} number(s); a pose is [NAME] TIME X Y Z, and after them RX RY RZ "
                                        "(a rotation vector) or QW QX QY QZ, in s, m and rad",
                                        words.size()));
  std::vector<double> values;
  for (const std::string& word : words) {
    const std::optional<double> value = number_of(word);
    if (!value) throw InputError(place, fmt::format("\"{}\" is no number", word));
    values.push_back(*value);
  }
  pose.time = values[0];
  pose.displacement = Vec3(values[1], values[2], values[3]);
  if (values.size() == 7) pose.turn = Vec3(values[4], values[5], values[6]);
  if (values.size() == 8) {
    const Eigen::Quaterniond quaternion(values[4], values[5], values[6], values[7]);
    if (!(quaternion.norm() > 1e-6 && quaternion.norm() < 1e6))
      throw InputError(place, fmt::format("a quaternion of length {:.3g} is no rotation", quaternion.norm()));
    pose.turn = turn_of(quaternion.normalized().toRotationMatrix());
    pose.whole_turns = false;
  }
  return pose;
}

Vec3 nearest_turn(const Vec3& turn, const Vec3& reference) {
  const double angle = turn.norm();
  if (angle < 1e-12) {  // no turn: any axis will do
    const double whole = 2 * std::numbers::pi * std::round(reference.norm() / (2 * std::numbers::pi));
    return whole == 0 ? turn : Vec3(turn + whole * reference.normalized());
  }
  const Vec3 axis = turn / angle;
  const double turns = std::round((axis.dot(reference) - angle) / (2 * std::numbers::pi));
  return turn + 2 * std::numbers::pi * turns * axis;
}

}  // namespace flexel::simulate
