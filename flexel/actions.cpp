// WHERE ends at the last colon, so that it may be an inline table of a scene; numbers and one unit follow.
#include "flexel/actions.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "base/error.h"
#include "base/math/area_vector.h"
#include "base/units.h"
#include "flexel/measure/face_shape.h"
#include "simulate/scene/scene_checks.h"

namespace flexel::commands {
namespace {

struct Amount {
  std::vector<std::string> numbers;
  std::string unit;
};

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

// Splits "0, 0, -50 N" and "-50N" into numbers and what follows the last of them.
Amount split_amount(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == ',' || c == '[' || c == ']'; }, ' ');
  Amount amount;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const char* begin = word.data() + (word.front() == '+' ? 1 : 0);
    double value = 0;
    const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
    if (error != std::errc() || !amount.unit.empty()) {
      amount.unit += (amount.unit.empty() ? "" : " ") + word;
      continue;
    }
    amount.numbers.emplace_back(begin, end);
    amount.unit = std::string(end, static_cast<const char*>(word.data() + word.size()));
  }
  return amount;
}

constexpr double kStandardGravity = 9.80665;  // m/s^2, ISO 80000-3

bool has_unit(Dimension dimension, const std::string& unit) {
  const std::vector<std::string> units = unit_names(dimension);
  return std::find(units.begin(), units.end(), unit) != units.end();
}

// The option that takes this unit, which the user likely means.
std::string other_option(Dimension dimension, const std::string& unit) {
  if (dimension == Dimension::force && has_unit(Dimension::torque, unit)) return "; --torque takes torques";
  if (dimension == Dimension::force && has_unit(Dimension::length, unit)) return "; --move takes lengths";
  if (dimension == Dimension::length && has_unit(Dimension::angle, unit)) return "; --twist takes angles";
  if (dimension == Dimension::length && has_unit(Dimension::force, unit)) return "; --push takes forces";
  return "";
}

// Takes the word "follower" from the end of a unit; false where it is not there.
bool take_follower(std::string& unit) {
  constexpr std::string_view kWord = " follower";
  if (unit.size() < kWord.size() || unit.compare(unit.size() - kWord.size(), kWord.size(), kWord) != 0)
    return false;
  unit = trimmed(unit.substr(0, unit.size() - kWord.size()));
  return true;
}

Action parse_action(const std::string& text, const std::string& option, Dimension dimension,
                    const std::string& example) {
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{} \"{}\": {}; write for example {}", option, text, what, example));
  };
  const std::size_t colon = text.rfind(':');
  Action action;
  if (colon == std::string::npos) fail("no colon between where and how much");
  action.where = trimmed(text.substr(0, colon));
  if (action.where.empty()) fail("nothing before the colon says where");
  Amount amount = split_amount(text.substr(colon + 1));
  action.follower = take_follower(amount.unit);
  if (action.follower && dimension != Dimension::force && dimension != Dimension::torque)
    fail("\"follower\" goes with forces, pressures and torques");
  const auto value = [&](std::size_t i, Dimension of) {
    try {
      return parse_quantity(amount.numbers[i] + " " + amount.unit, of);
    } catch (const InputError& error) {
      throw InputError(
          fmt::format("{} \"{}\": {}{}", option, text, error.what(), other_option(dimension, amount.unit)));
    }
  };
  if (amount.numbers.size() == 3) {
    action.vector = Vec3(value(0, dimension), value(1, dimension), value(2, dimension));
  } else if (amount.numbers.size() == 1) {
    if (dimension == Dimension::force && has_unit(Dimension::pressure, amount.unit))
      action.pressure = value(0, Dimension::pressure);
    else
      action.along = value(0, dimension);
  } else {
    fail(fmt::format("{} numbers after the colon, not one or three", amount.numbers.size()));
  }
  return action;
}

// Unit, outward; of a side its axis.
Vec3 mean_normal(const simulate::Selection& selection, const simulate::Selected& selected, const Body& body,
                 const std::string& example) {
  if (const auto axis = side_axis(selection, body)) return *axis;
  const Surface& surface = body.surface;
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const std::uint32_t p : selected.polygons) {
    const Vec3 vector = area_vector(surface.vertices, surface.polygon(p));
    sum += vector;
    area += vector.norm();
  }
  // Under a tenth of the area is left: the faces look every way (a whole cylinder, two opposite sides).
  if (!(sum.norm() > 0.1 * area))
    throw InputError(
        selection.origin,
        fmt::format("\"{}\" has no direction of its own: give three components, as in \"{}: {}\"",
                    describe(selection), describe(selection), example));
  return sum.normalized();
}

}  // namespace

Action parse_push(const std::string& text) {
  return parse_action(text, "--push", Dimension::force,
                      "--push \"xmax: 0 0 -50 N\" or --push \"part/3: 50 N\"");
}

Action parse_move(const std::string& text) {
  return parse_action(text, "--move", Dimension::length,
                      "--move \"xmax: 0 0 -2 mm\" or --move \"part/3: 2 mm\"");
}

Action parse_torque(const std::string& text) {
  return parse_action(text, "--torque", Dimension::torque,
                      "--torque \"xmax: 5 N m\" or --torque \"part/3: 0 0 5 N m\"");
}

Action parse_twist(const std::string& text) {
  return parse_action(text, "--twist", Dimension::angle,
                      "--twist \"xmax: 10 deg\" or --twist \"part/3: 0 0 10 deg\"");
}

Action parse_bearing(const std::string& text) {
  const char* example = "--bearing \"part/3: 0 0 -200 N\"";
  Action action = parse_action(text, "--bearing", Dimension::force, example);
  if (action.follower)
    throw InputError(
        fmt::format("--bearing \"{}\": a pin's load does not follow the hole; leave \"follower\" out", text));
  if (!action.vector || *action.vector == Vec3::Zero())
    throw InputError(
        fmt::format("--bearing \"{}\": a pin presses in a direction: give three components, for example {}",
                    text, example));
  return action;
}

Vec3 parse_gravity(const std::string& text) {
  Amount amount = split_amount(text);
  double scale = 1;
  if (amount.unit == "g") {  // not the gram
    scale = kStandardGravity;
    amount.unit = "m/s^2";
  }
  std::vector<double> values;
  for (const std::string& number : amount.numbers) try {
      values.push_back(scale * parse_quantity(number + " " + amount.unit, Dimension::acceleration));
    } catch (const InputError& error) {
      throw InputError(fmt::format("--gravity \"{}\": {}", text, error.what()));
    }
  if (values.size() == 1 && values[0] < 0)
    throw InputError(fmt::format(
        "--gravity \"{}\": one number acts downwards (-z): leave the sign out, or give three components",
        text));
  if (values.size() == 1) return {0, 0, -values[0]};
  if (values.size() == 3) return {values[0], values[1], values[2]};
  throw InputError(
      fmt::format("--gravity \"{}\": {} numbers, not one or three; write for example --gravity \"1 g\" or "
                  "--gravity \"0 0 "
                  "-9.81 m/s^2\"",
                  text, values.size()));
}

simulate::Probe parse_probe(const std::string& text) {
  simulate::Probe probe;
  probe.origin = "--probe";
  const std::size_t colon = text.find(':');
  probe.name = trimmed(text.substr(0, colon));
  const std::string rest = colon == std::string::npos ? probe.name : trimmed(text.substr(colon + 1));
  if (probe.name.empty() || rest.empty())
    throw InputError(
        fmt::format("--probe \"{}\": write for example --probe \"tip: 10 5 3 mm\" or --probe \"tip: "
                    "part/3\"",
                    text));
  const Amount amount = split_amount(rest);
  if (!amount.numbers.empty() && has_unit(Dimension::length, amount.unit)) {
    if (amount.numbers.size() != 3)
      throw InputError(fmt::format(
          "--probe \"{}\": a point has three coordinates, for example \"{}: 10 5 3 mm\"", text, probe.name));
    probe.at = Vec3::Zero();
    for (int i = 0; i < 3; ++i)
      (*probe.at)[i] =
          parse_quantity(amount.numbers[static_cast<std::size_t>(i)] + " " + amount.unit, Dimension::length);
  } else {
    probe.where = simulate::parse_where(rest, probe.origin);
    if (colon == std::string::npos) probe.name = describe(*probe.where);
  }
  return probe;
}

Vec3 inward_normal(const simulate::Selection& selection, const Body& body) {
  return -mean_normal(selection, resolve(selection, body), body, "0 0 -50 N");
}

FaceAxis face_axis(const simulate::Selection& selection, const Body& body, const std::optional<Vec3>& given) {
  const simulate::Selected selected = resolve(selection, body);
  if (selected.polygons.empty())
    throw InputError(
        selection.origin,
        fmt::format("{} selects elements: name a face or a side, which has an axis", describe(selection)));
  const FaceShape shape = face_shape(body.surface, selected.polygons);
  const bool round = shape.kind == FaceShape::Kind::round && !side_axis(selection, body);
  if (given && *given != Vec3::Zero())
    return {given->normalized(), round ? shape.axis_point : shape.centroid};
  if (round) return {shape.axis, shape.axis_point};
  return {mean_normal(selection, selected, body, "0 0 5 N m"), shape.centroid};
}

void add_push(simulate::Scene& scene, const Action& action, const Body& body) {
  const simulate::Selection where = simulate::parse_where(action.where, "--push");
  std::vector<simulate::Load>& loads = scene.get<simulate::Loads>().loads;
  if (action.pressure) {
    loads.push_back(make_pressure(where, *action.pressure));
  } else {
    loads.push_back(simulate::make_push(
        where, action.vector ? *action.vector : Vec3(*action.along * inward_normal(where, body))));
  }
  loads.back().follower = action.follower;
}

void add_move(simulate::Scene& scene, const Action& action, const Body& body) {
  const simulate::Selection where = simulate::parse_where(action.where, "--move");
  scene.get<simulate::Supports>().ties.push_back(simulate::make_move(
      where, action.vector ? *action.vector : Vec3(*action.along * inward_normal(where, body))));
}

void add_torque(simulate::Scene& scene, const Action& action, const Body& body) {
  simulate::Load load;
  load.where = simulate::parse_where(action.where, "--torque");
  load.name = describe(load.where);
  load.origin = load.where.origin;
  load.torque = action.vector ? *action.vector : Vec3(*action.along * face_axis(load.where, body).direction);
  load.follower = action.follower;
  scene.get<simulate::Loads>().loads.push_back(std::move(load));
}

void add_twist(simulate::Scene& scene, const Action& action, const Body& body) {
  simulate::Tie tie = simulate::make_move(simulate::parse_where(action.where, "--twist"), Vec3::Zero());
  const FaceAxis axis = face_axis(tie.where, body, action.vector);
  tie.motion.angle = action.along ? *action.along : action.vector->norm();
  tie.motion.axis = axis.direction;
  tie.motion.through = axis.through;
  scene.get<simulate::Supports>().ties.push_back(std::move(tie));
}

void add_bearing(simulate::Scene& scene, const Action& action) {
  simulate::Load load = simulate::make_push(simulate::parse_where(action.where, "--bearing"), *action.vector);
  load.bearing = true;
  scene.get<simulate::Loads>().loads.push_back(std::move(load));
}

}  // namespace flexel::commands
