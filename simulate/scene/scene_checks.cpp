// Selections are compared polygon by polygon and element by element; a polygon lies on held elements where
// all that carry its middle are held. Each polygon counts by its area, each element once.
#include "simulate/scene/scene_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/math/area_vector.h"
#include "formats/lattice/locate.h"
#include "simulate/input/scene_words.h"

namespace flexel::simulate {
namespace {

constexpr double kHeld = 0.99, kPartlyHeld = 0.1;  // of a load
constexpr double kOffAxis = 10;                    // degrees
constexpr double kCarries = 1e-6;                  // weight of an element

// Loads and moves act whole at equilibrium.
void refuse_course(const TimeCurve& course, const std::string& origin, const std::string& what) {
  if (course.time.empty()) return;
  throw InputError(
      origin,
      fmt::format("{} has \"time\" and \"factor\", and equilibrium has no time: leave them out (all of it "
                  "acts then), or give [run] time = \"{:.6g} s\"",
                  what, course.time.back() > 0 ? course.time.back() : 1));
}

void refuse_courses(const Scene& scene) {
  for (const Load& load : scene.get<Loads>().loads)
    refuse_course(load.course, load.origin, fmt::format("load \"{}\"", load.name));
  for (const Tie& tie : scene.get<Supports>().ties)
    refuse_course(tie.course, tie.origin, fmt::format("{} \"{}\"", tie.link ? "load" : "move", tie.name));
}

// Bit a: world axis a is held or led.
struct HeldMasks {
  std::vector<std::uint8_t> polygon, element;
  bool elements = false;  // any of them
};

std::uint8_t axes_of(const Tie& tie) {
  return static_cast<std::uint8_t>(tie.axes[0] | tie.axes[1] << 1 | tie.axes[2] << 2);
}

// Of fixes, and with `moves` of those too.
HeldMasks held_masks(const std::vector<Tie>& ties, bool moves, const Body& body) {
  HeldMasks held{std::vector<std::uint8_t>(body.surface.polygon_count(), 0),
                 std::vector<std::uint8_t>(body.element_count(), 0)};
  for (const Tie& tie : ties) {
    if (tie.link || (tie.is_move && !moves)) continue;
    const std::uint8_t mask = axes_of(tie);
    const Selected selected = resolve(tie.where, body);
    for (const std::uint32_t p : selected.polygons) held.polygon[p] |= mask;
    for (const std::uint32_t e : selected.elements) held.element[e] |= mask;
    held.elements = held.elements || !selected.elements.empty();
  }
  return held;
}

// Axes along which the elements under a polygon's middle are held.
std::uint8_t held_under(const HeldMasks& held, const Body& body, std::uint32_t polygon) {
  if (!held.elements) return 0;
  const auto corners = body.surface.polygon(polygon);
  Vec3 middle = Vec3::Zero();
  for (const std::uint32_t v : corners)
    middle += body.surface.vertices[v] / static_cast<double>(corners.size());
  const auto at = locate_on_surface(body, polygon, middle);
  if (!at) return 0;
  std::uint8_t mask = 7;
  for (std::size_t a = 0; a < 8; ++a)
    if (std::abs(at->weights[a]) > kCarries) mask &= held.element[body.cell_elements[at->cell][a]];
  return mask;
}

// Of what acts along `along`, with that weight on each axis.
double along_axes(const Vec3& along, std::uint8_t mask) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis)
    if ((mask >> axis & 1) != 0) sum += std::abs(along[axis]);
  return sum;
}

// The share of a load that acts where supports hold the body along it.
double held_share(const Load& load, const HeldMasks& held, const Body& body) {
  const Selected selected = resolve(load.where, body);
  const Vec3 force = load.force.value_or(Vec3::Zero()), torque = load.torque.value_or(Vec3::Zero());
  // A torque acts across its axis.
  const Vec3 acting = torque != Vec3::Zero()  ? Vec3(Vec3::Ones() - torque.normalized().cwiseAbs())
                      : force == Vec3::Zero() ? Vec3(Vec3::Ones())
                                              : force.normalized();
  double straight = 0, whole = 0;
  const auto count = [&](const Vec3& along, std::uint8_t mask) {
    straight += along_axes(along, mask);
    whole += along_axes(along, 7);
  };
  for (const std::uint32_t p : selected.polygons) {
    const Vec3 area = area_vector(body.surface.vertices, body.surface.polygon(p));
    const Vec3 along = load.pressure ? area : Vec3(area.norm() * acting);
    count(along, static_cast<std::uint8_t>(held.polygon[p] | held_under(held, body, p)));
  }
  for (const std::uint32_t e : selected.elements) count(acting, held.element[e]);
  return whole > 0 ? straight / whole : 0;
}

void check_held(const Load& load, double share, Progress& progress) {
  if (share >= kHeld)
    throw InputError(load.origin,
                     fmt::format("load \"{}\" does nothing: {} holds the place where it acts; select another "
                                 "face, or fix other axes",
                                 load.name, words_of(load.origin).fix_or_move));
  if (share >= kPartlyHeld)
    progress.warn(fmt::format(
        "{}: {:.0f} % of load \"{}\" goes straight into a support: {} holds that share of the place where "
        "it acts",
        load.origin, 100 * share, load.name, words_of(load.origin).fix_or_move));
}

// A surface that is led, on elements that are held: neither gets its way. (What is led and held by the same
// kind of selection is refused where ties are made.)
void check_move(const Tie& move, const HeldMasks& fixes, const Body& body) {
  std::uint8_t moving = 0;  // axes along which it goes somewhere
  for (int axis = 0; axis < 3; ++axis)
    if ((move.motion.angle != 0 && std::abs(move.motion.axis[axis]) < 1 - 1e-9) ||
        move.motion.translation[axis] != 0)
      moving = static_cast<std::uint8_t>(moving | (axes_of(move) & 1 << axis));
  if (moving == 0) return;
  double both = 0, whole = 0;
  for (const std::uint32_t p : resolve(move.where, body).polygons) {
    const double area = area_vector(body.surface.vertices, body.surface.polygon(p)).norm();
    if ((held_under(fixes, body, p) & moving) != 0) both += area;
    whole += area;
  }
  if (both > kPartlyHeld * whole)
    throw InputError(move.origin,
                     fmt::format("move \"{}\": a [[fix]] of elements holds {:.0f} % of the place that is to "
                                 "move; give the fix other elements or axes",
                                 move.name, 100 * both / whole));
}

// Degrees between the mean normal of a side's polygons and its axis.
void check_side(const Load& load, const Body& body, Progress& progress) {
  const std::optional<Vec3> axis = side_axis(load.where, body);
  if (!load.pressure || !axis) return;
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t p : resolve(load.where, body).polygons)
    sum += area_vector(body.surface.vertices, body.surface.polygon(p));
  if (!(sum.norm() > 0)) return;
  // A mesh whose polygons face inwards is no slanted side.
  const double off =
      180 / std::numbers::pi * std::acos(std::clamp(std::abs(sum.normalized().dot(*axis)), 0.0, 1.0));
  if (off > kOffAxis)
    progress.warn(
        fmt::format("{}: the faces of \"{}\" look {:.0f} degrees away from that axis on average, and the "
                    "pressure pushes along their normals; give a \"force\" for another direction",
                    load.origin, load.name, off));
}

}  // namespace

void check_actions(const Scene& scene, const Body& body, Progress& progress) {
  warn_of_unused_materials(scene, body, progress);
  if (!scene.run.time) refuse_courses(scene);
  const std::vector<Tie>& ties = scene.get<Supports>().ties;
  if (std::any_of(ties.begin(), ties.end(), [](const Tie& tie) { return tie.is_move; })) {
    const HeldMasks fixes = held_masks(ties, false, body);
    for (const Tie& tie : ties)
      if (tie.is_move) check_move(tie, fixes, body);
  }
  if (scene.get<Loads>().loads.empty()) return;
  const HeldMasks held = held_masks(ties, true, body);
  for (const Load& load : scene.get<Loads>().loads) {
    check_held(load, held_share(load, held, body), progress);
    check_side(load, body, progress);
  }
}

}  // namespace flexel::simulate
