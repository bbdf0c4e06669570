// The last colon ends WHERE, so that WHERE may be a table of the scene's language; what follows is numbers
// and one unit.
#include "flexel/actions.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "formats/area_vector.h"
#include "formats/error.h"
#include "formats/units.h"
#include "simulate/scene_checks.h"

namespace flexel {
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

bool has_unit(Dimension dimension, const std::string& unit) {
  const std::vector<std::string> units = unit_names(dimension);
  return std::find(units.begin(), units.end(), unit) != units.end();
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
  const Amount amount = split_amount(text.substr(colon + 1));
  const auto value = [&](std::size_t i, Dimension of) {
    try {
      return parse_quantity(amount.numbers[i] + " " + amount.unit, of);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{} \"{}\": {}", option, text, error.what()));
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

}  // namespace

Action parse_push(const std::string& text) {
  return parse_action(text, "--push", Dimension::force,
                      "--push \"xmax: 0 0 -50 N\" or --push \"part/3: 50 N\"");
}

Action parse_move(const std::string& text) {
  return parse_action(text, "--move", Dimension::length,
                      "--move \"xmax: 0 0 -2 mm\" or --move \"part/3: 2 mm\"");
}

Vec3 inward_normal(const Selection& selection, const Body& body) {
  const Selected selected = resolve(selection, body);
  if (const auto axis = side_axis(selection, body)) return -*axis;
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
        fmt::format("\"{}\" has no direction of its own: give three components, as in \"{}: 0 0 -50 N\"",
                    describe(selection), describe(selection)));
  return -sum.normalized();
}

void add_push(Scene& scene, const Action& action, const Body& body) {
  const Selection where = parse_where(action.where, "--push");
  std::vector<Load>& loads = scene.get<Loads>().loads;
  if (action.pressure) {
    loads.push_back(make_pressure(where, *action.pressure));
  } else {
    loads.push_back(
        make_push(where, action.vector ? *action.vector : Vec3(*action.along * inward_normal(where, body))));
  }
}

void add_move(Scene& scene, const Action& action, const Body& body) {
  const Selection where = parse_where(action.where, "--move");
  scene.get<Ties>().ties.push_back(
      make_move(where, action.vector ? *action.vector : Vec3(*action.along * inward_normal(where, body))));
}

}  // namespace flexel
