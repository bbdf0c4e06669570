// The angle is measured on the deformed part, not taken from what was asked for.
#include "flexel/flex/flex.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/units.h"
#include "flexel/measure/face_shape.h"
#include "simulate/input/scene_selection.h"

namespace flexel::commands {
namespace {

constexpr double kMostTurns = 4;                 // in all: further on a part lies within itself
constexpr double kMissed = 0.05, kFailed = 0.5;  // of the angle
constexpr double kDegrees = 180 / std::numbers::pi;

double parse_flex_angle(const std::string& text, const char* option) {
  double angle = 0;
  try {
    angle = parse_quantity(text, Dimension::angle);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} \"{}\": {}", option, text, error.what()));
  }
  if (angle == 0) throw InputError(fmt::format("{} \"{}\" leaves the part as it is", option, text));
  if (std::abs(angle) > 2 * std::numbers::pi * kMostTurns)
    throw InputError(
        fmt::format("{} \"{}\": more than {} whole turns; give a smaller angle", option, text, kMostTurns));
  return angle;
}

// "x", "y" or "z".
std::optional<Eigen::Index> axis_called(const std::string& name) {
  if (name.size() != 1 || name[0] < 'x' || name[0] > 'z') return std::nullopt;
  return name[0] - 'x';
}

Vec3 parse_about(const std::string& text, std::optional<Eigen::Index> along) {
  const bool back = text.front() == '-';
  const std::optional<Eigen::Index> axis = axis_called(back ? text.substr(1) : text);
  if (!axis) throw InputError(fmt::format("--about \"{}\": use x, y, z, -x, -y or -z", text));
  if (along == axis)
    throw InputError(
        "--about is the axis of --along: a bend turns about one across it; --twist turns about it");
  return Vec3::Unit(*axis) * (back ? -1 : 1);
}

simulate::Selection side(const std::string& name, const Flex& flex) {
  return simulate::parse_where(name, flex.bends ? "--bend" : "--twist");
}

// Points at rest and now, m.
struct Moved {
  std::vector<Vec3> rest, now;
};

// The rotation nearest to a sum of places now times those at rest; nothing where they lie on a line.
std::optional<Mat3> turn_of(const Mat3& product) {
  constexpr double kOneLine = 1e-9;
  const NearestRotation nearest = nearest_rotation(product);
  if (!(nearest.values[1] > kOneLine * nearest.values[0])) return std::nullopt;
  return nearest.rotation;
}

// That of the rigid motion nearest to theirs.
std::optional<Mat3> turn_of(const Moved& points) {
  Vec3 middle = Vec3::Zero(), moved = Vec3::Zero();
  for (std::size_t i = 0; i < points.rest.size(); ++i) {
    middle += points.rest[i] / static_cast<double>(points.rest.size());
    moved += points.now[i] / static_cast<double>(points.rest.size());
  }
  Mat3 product = Mat3::Zero();
  for (std::size_t i = 0; i < points.rest.size(); ++i)
    product += (points.now[i] - moved) * (points.rest[i] - middle).transpose();
  return turn_of(product);
}

// Of the vertices of these polygons.
Mat3 turn_of_side(const Body& body, const simulate::Selected& selected,
                  const std::vector<Vec3>& displacement) {
  std::vector<std::uint8_t> taken(body.surface.vertices.size(), 0);
  for (const std::uint32_t p : selected.polygons)
    for (const std::uint32_t v : body.surface.polygon(p)) taken[v] = 1;
  Moved side;
  for (std::size_t v = 0; v < taken.size(); ++v)
    if (taken[v]) {
      side.rest.push_back(body.surface.vertices[v]);
      side.now.push_back(body.surface.vertices[v] + displacement[v]);
    }
  return turn_of(side).value_or(Mat3::Identity());
}

// rad, about the axis that the ends turn about, from one of two rotations to the other; under half a turn.
double turn_between(const Mat3& one, const Mat3& other, const FlexFrame& frame) {
  const Eigen::AngleAxisd between(Mat3(one.transpose() * other));
  return between.angle() * between.axis().dot(frame.axis);
}

// rad, summed up over slices of the matter from the held end to the other: near enough to count whole turns. Within a slice
// connections count, not places: those of two bars beside each other say how the pair lies.
double turn_along(const Mat3& held, const Mat3& led, const FlexFrame& frame, const Body& body) {
  constexpr double kSlice = 1.5;  // spacings
  constexpr std::size_t kMostSlices = 200;
  const Box box = bounding_box(body.rest);
  const double from = box.min[frame.along], way = box.max[frame.along] - from;
  double spacing = 0;
  for (const Part& part : body.parts) spacing = std::max(spacing, part.lattice.spacing.maxCoeff());
  const auto count = static_cast<double>(
      std::clamp(static_cast<std::size_t>(way / (kSlice * spacing)), std::size_t{1}, kMostSlices));
  std::vector<Mat3> slices(static_cast<std::size_t>(count), Mat3::Zero());
  const Adjacency graph = element_adjacency(body);
  for (std::uint32_t e = 0; e < body.rest.size(); ++e)
    for (const std::uint32_t other : graph.of(e)) {
      const double middle = (body.rest[e][frame.along] + body.rest[other][frame.along]) / 2;
      const double slice = std::clamp((middle - from) / way * count, 0.0, count - 0.5);
      slices[static_cast<std::size_t>(slice)] +=
          (body.position[other] - body.position[e]) * (body.rest[other] - body.rest[e]).transpose();
    }
  double sum = 0;
  Mat3 last = held;
  for (const Mat3& slice : slices) {
    const std::optional<Mat3> turn = turn_of(slice);
    if (!turn) continue;
    sum += turn_between(last, *turn, frame);
    last = *turn;
  }
  return sum + turn_between(last, led, frame);
}

}  // namespace

void declare_flex(CommandLine& app, FlexArguments& arguments) {
  app.add_option("--bend", arguments.bend, "Bend the part to an arc of this angle (\"90 deg\")")
      .type_name("ANGLE");
  app.add_option("--twist", arguments.twist,
                 "Or: turn one end about the way to the other by this angle (\"45 deg\")")
      .type_name("ANGLE");
  app.add_option("--along", arguments.along,
                 "The axis that the ends lie along: x, y or z (default: the longest)")
      .type_name("AXIS");
  app.add_option("--about", arguments.about,
                 "The axis that a bend turns about: x, y, z, -x, -y or -z (default: towards the thin side)")
      .type_name("AXIS");
}

Flex plan_flex(const FlexArguments& arguments) {
  if (arguments.bend.empty() == arguments.twist.empty())
    throw InputError(arguments.bend.empty()
                         ? "nothing bends the part: give --bend \"90 deg\" or --twist \"45 deg\""
                         : "give --bend or --twist, not both");
  Flex flex;
  flex.bends = arguments.twist.empty();
  flex.angle =
      flex.bends ? parse_flex_angle(arguments.bend, "--bend") : parse_flex_angle(arguments.twist, "--twist");
  if (!arguments.along.empty()) {
    flex.along = axis_called(arguments.along);
    if (!flex.along) throw InputError(fmt::format("--along \"{}\": use x, y or z", arguments.along));
  }
  if (arguments.about.empty()) return flex;
  if (!flex.bends)
    throw InputError("--about is of --bend: a twist turns about the way from end to end (--along)");
  flex.about = parse_about(arguments.about, flex.along);
  return flex;
}

FlexFrame flex_frame(const Flex& flex, const Surface& surface) {
  const Box box = bounding_box(surface.vertices);
  const Vec3 size = box.max - box.min;
  FlexFrame frame;
  if (flex.along) {
    frame.along = *flex.along;
  } else {
    Vec3 open = size;  // an axis that the bend turns about is none along the part
    if (flex.about) open = open.cwiseProduct(Vec3::Ones() - flex.about->cwiseAbs());
    open.maxCoeff(&frame.along);
  }
  const char letter = "xyz"[frame.along];
  frame.held = fmt::format("{}min", letter);
  frame.led = fmt::format("{}max", letter);
  const Vec3 way = Vec3::Unit(frame.along);
  if (!flex.bends) {
    frame.axis = way;
  } else if (flex.about) {
    frame.axis = *flex.about;
  } else {
    const Eigen::Index one = (frame.along + 1) % 3, other = (frame.along + 2) % 3;
    const Vec3 thin = Vec3::Unit(size[one] < size[other] ? one : other);
    frame.axis = way.cross(thin);  // turns the way towards the thin side
  }
  return frame;
}

void add_flex(simulate::Scene& scene, const Flex& flex, const Body& body) {
  const FlexFrame frame = flex_frame(flex, body.surface);
  std::array<Vec3, 2> middle;
  for (const int end : {0, 1}) {
    const std::string& name = end == 0 ? frame.held : frame.led;
    const simulate::Selected selected = resolve(side(name, flex), body);
    const FaceShape shape = face_shape(body.surface, selected.polygons);
    if (!(shape.area > 0))
      throw InputError(
          fmt::format("flexel flex: the part has no face at its end \"{}\"; choose the ends with --along, or "
                      "use flexel deform with --fix and --twist",
                      name));
    middle[static_cast<std::size_t>(end)] = shape.centroid;
  }
  std::vector<simulate::Tie>& ties = scene.get<simulate::Supports>().ties;
  ties.push_back(simulate::make_fix(side(frame.held, flex)));
  simulate::Tie led = simulate::make_move(side(frame.led, flex), Vec3::Zero());
  led.motion.angle = flex.angle;
  led.motion.axis = frame.axis;
  led.motion.through = middle[1];
  if (flex.bends) led.motion.arc_from = middle[0];
  ties.push_back(std::move(led));
}

double measure_flex(const Flex& flex, const Body& body, const std::vector<Vec3>& displacement) {
  const FlexFrame frame = flex_frame(flex, body.surface);
  const Mat3 held = turn_of_side(body, resolve(side(frame.held, flex), body), displacement);
  const Mat3 led = turn_of_side(body, resolve(side(frame.led, flex), body), displacement);
  const double between = turn_between(held, led, frame), whole = 2 * std::numbers::pi;
  return between + whole * std::round((turn_along(held, led, frame, body) - between) / whole);
}

bool flex_failed(const Flex& flex, const FlexAnswer& answer) {
  return std::abs(answer.angle - flex.angle) > kFailed * std::abs(flex.angle);
}

std::string flex_warning(const Flex& flex, const FlexAnswer& answer) {
  if (std::abs(answer.angle - flex.angle) < kMissed * std::abs(flex.angle)) return "";
  return fmt::format(
      "the ends have turned by {:.2f} deg, not by {:.2f} deg: the part reaches an end with an edge or a "
      "tip, or its cells are too large there, and it gives way; use a smaller --size, choose the ends with "
      "--along, or lead whole faces with flexel deform --fix and --twist",
      kDegrees * answer.angle, kDegrees * flex.angle);
}

std::string flex_line(const Flex& flex, const FlexAnswer& answer) {
  std::string line =
      fmt::format("{} by {:.2f} deg between its ends ({:.2f} deg asked for)", flex.bends ? "bent" : "twisted",
                  kDegrees * answer.angle, kDegrees * flex.angle);
  if (answer.volume_change) line += fmt::format("; volume {:+.2f} %", 100 * *answer.volume_change);
  return line;
}

}  // namespace flexel::commands
