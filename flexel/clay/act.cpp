// A line is a word and what it needs; a line of numbers is a pose, as live runs have them (simulate/rigid/pose_line.h).
#include "flexel/clay/act.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/printable.h"
#include "base/program/arguments.h"
#include "simulate/rigid/pose_line.h"

namespace flexel::clay {
namespace {

constexpr double kFarthest = 1000, kMostTurn = 200 * std::numbers::pi;  // m, rad
constexpr std::size_t kLongestName = 512, kClientDigits = 16;

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  std::size_t begin = 0;
  while ((begin = text.find_first_not_of(' ', begin)) != std::string::npos) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

double number(const std::string& text, double largest, const std::string& place) {
  double value = 0;
  if (!is_number(text, value) || !std::isfinite(value) || std::abs(value) > largest)
    throw InputError(place, fmt::format("\"{}\" is no number up to {}", printable(text), largest));
  return value;
}

Vec3 vector(const std::vector<std::string>& words, std::size_t from, double largest,
            const std::string& place) {
  if (words.size() < from + 3) throw InputError(place, "three numbers are needed");
  return {number(words[from], largest, place), number(words[from + 1], largest, place),
          number(words[from + 2], largest, place)};
}

std::string name_of(const std::string& rest, const std::string& place) {
  if (rest.empty() || rest.size() > kLongestName || printable(rest) != rest)
    throw InputError(place, "a name is needed, of printable characters");
  return rest;
}

Act pose_act(const std::string& line, const std::string& place) {
  const std::optional<simulate::PoseLine> pose = simulate::parse_pose_line(line, place);
  if (!pose || pose->end || !pose->tool.empty()) throw InputError(place, "is no act");
  Act act;
  act.pose = {pose->displacement, pose->turn};
  if (act.pose.displacement.cwiseAbs().maxCoeff() > kFarthest || act.pose.turn.norm() > kMostTurn)
    throw InputError(place, "is beyond 1 km or 100 turns");
  return act;
}

Act grab_act(const std::string& rest, const std::string& place) {
  Act act{Act::Kind::grab, "", {}};
  const std::vector<std::string> words = words_of(rest);
  if (words.empty()) throw InputError(place, "grab: give \"face NAME\" or \"at X Y Z RADIUS\"");
  if (words[0] == "face") {
    act.name = name_of(rest.substr(std::min(rest.size(), rest.find("face") + 5)), place);
  } else if (words[0] == "at" && words.size() == 5) {
    act.at = vector(words, 1, kFarthest, place);
    act.radius = number(words[4], kFarthest, place);
    if (!(act.radius > 0)) throw InputError(place, "a ball has a radius above 0");
  } else {
    throw InputError(place, "grab: give \"face NAME\" or \"at X Y Z RADIUS\"");
  }
  return act;
}

// "ball X Y Z NX NY NZ RADIUS", or "plate ..."
Act push_act(const std::string& rest, const std::string& place) {
  const std::vector<std::string> words = words_of(rest);
  if (words.size() != 8 || (words[0] != "ball" && words[0] != "plate"))
    throw InputError(place, "push: give \"ball X Y Z NX NY NZ RADIUS\" or \"plate X Y Z NX NY NZ RADIUS\"");
  Act act{Act::Kind::push, words[0], {}};
  act.at = vector(words, 1, kFarthest, place);
  act.from = vector(words, 4, kFarthest, place);
  if (!(act.from.norm() > 1e-6)) throw InputError(place, "push: NX NY NZ is no direction");
  act.from.normalize();
  act.radius = number(words[7], kFarthest, place);
  if (!(act.radius > 0)) throw InputError(place, "a tool has a radius above 0");
  return act;
}

// "at X Y Z RADIUS", and for glue how near.
Act ball_act(Act::Kind kind, const std::string& rest, const std::string& place) {
  const bool glues = kind == Act::Kind::glue;
  const std::vector<std::string> words = words_of(rest);
  if (words.size() != (glues ? 6 : 5) || words[0] != "at")
    throw InputError(place, glues ? "glue: give \"at X Y Z RADIUS WITHIN\""
                                  : "carve: give \"at X Y Z RADIUS\", \"from X Y Z RADIUS\" or \"to X Y Z\"");
  Act act{kind, "", {}};
  act.at = vector(words, 1, kFarthest, place);
  act.radius = number(words[4], kFarthest, place);
  if (!(act.radius > 0)) throw InputError(place, "a ball has a radius above 0");
  if (glues) act.within = number(words[5], kFarthest, place);
  if (glues && !(act.within > 0)) throw InputError(place, "glue reaches farther than 0");
  return act;
}

// "from X Y Z RADIUS", or "to X Y Z"
Act draw_act(const std::string& rest, const std::string& place) {
  const std::vector<std::string> words = words_of(rest);
  Act act{Act::Kind::draw, "", {}};
  act.on = words[0] == "from";
  if (words.size() != (act.on ? 5 : 4))
    throw InputError(place, act.on ? "carve: give \"from X Y Z RADIUS\"" : "carve: give \"to X Y Z\"");
  act.way = {vector(words, 1, kFarthest, place)};
  if (act.on) act.radius = number(words[4], kFarthest, place);
  if (act.on && !(act.radius > 0)) throw InputError(place, "a ball has a radius above 0");
  return act;
}

// A material has no blank here: "spring-steel" is spring steel.
Act paint_act(const std::string& rest, const std::string& place) {
  const std::size_t space = std::min(rest.find(' '), rest.size());
  Act act{Act::Kind::paint, name_of(rest.substr(std::min(space + 1, rest.size())), place), {}};
  act.material = name_of(rest.substr(0, space), place);
  return act;
}

Act hand_act(const std::string& rest, const std::string& place) {
  const std::vector<std::string> words = words_of(rest);
  if (words.size() != 3 && words.size() != 6) throw InputError(place, "hand: give X Y Z, or X Y Z RX RY RZ");
  Act act{Act::Kind::hand, "", {}};
  act.pose.displacement = vector(words, 0, kFarthest, place);
  if (words.size() == 6) act.pose.turn = vector(words, 3, kMostTurn, place);
  return act;
}

Act parse_act(const std::string& line, const std::string& place) {
  const std::size_t space = std::min(line.find(' '), line.size());
  const std::string word = line.substr(0, space), rest = line.substr(std::min(space + 1, line.size()));
  const auto plain = [&](Act::Kind kind) {
    if (!rest.empty()) throw InputError(place, fmt::format("\"{}\" stands alone", word));
    return Act{kind, "", {}};
  };
  if (word == "hold" || word == "free") {
    Act act{Act::Kind::hold, name_of(rest, place), {}};
    act.on = word == "hold";
    return act;
  }
  if (word == "grab") return grab_act(rest, place);
  if (word == "push") return push_act(rest, place);
  if (word == "carve" && (rest.starts_with("from ") || rest.starts_with("to "))) return draw_act(rest, place);
  if (word == "carve") return ball_act(Act::Kind::carve, rest, place);
  if (word == "glue") return ball_act(Act::Kind::glue, rest, place);
  if (word == "hand") return hand_act(rest, place);
  if (word == "material") return {Act::Kind::material, name_of(rest, place), {}};
  if (word == "paint") return paint_act(rest, place);
  if (word == "stay") return plain(Act::Kind::stay);
  if (word == "release") return plain(Act::Kind::release);
  if (word == "keep") return plain(Act::Kind::keep);
  if (word == "cancel") return plain(Act::Kind::cancel);
  if (word == "undo") return plain(Act::Kind::undo);
  if (word == "redo") return plain(Act::Kind::redo);
  if (word == "take") return plain(Act::Kind::take);
  return pose_act(line, place);
}

}  // namespace

bool is_client_name(const std::string& text) {
  return text.size() == kClientDigits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

ActMessage parse_acts(const std::string& text) {
  if (text.size() > kLargestMessage) throw InputError("a message has at most 16 KiB");
  ActMessage message;
  std::size_t begin = 0;
  for (std::size_t number = 1; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin), place = fmt::format("line {}", number);
    begin = end + 1;
    if (number == 1) {
      message.client = line.starts_with("client ") ? line.substr(7) : "";
      if (!is_client_name(message.client))
        throw InputError(place, "\"client\" and 16 hexadecimal digits are needed first");
      continue;
    }
    if (line.empty()) continue;
    if (message.acts.size() == kMostActs) throw InputError(place, "a message has at most 256 acts");
    message.acts.push_back(parse_act(line, place));
  }
  if (message.client.empty()) throw InputError("a message is empty");
  return message;
}

}  // namespace flexel::clay
