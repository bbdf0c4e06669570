// Selections are compared polygon by polygon and element by element; a place of a polygon lies on held elements where
// all that carry it are held. Each place counts by its area, each element once.
#include "simulate/scene/scene_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/human.h"
#include "base/math/area_vector.h"
#include "formats/lattice/locate.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/input/scene_words.h"

namespace flexel::simulate {
namespace {

constexpr double kHeld = 0.99, kPartlyHeld = 0.1;  // of a load, of a surface that is held or led
constexpr double kAtOdds = 0.005;                  // likewise: told from here on
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

HeldMasks held_masks(const std::vector<Tie>& ties, const Body& body) {
  HeldMasks held{std::vector<std::uint8_t>(body.surface.polygon_count(), 0),
                 std::vector<std::uint8_t>(body.element_count(), 0)};
  for (const Tie& tie : ties) {
    if (tie.link) continue;
    const std::uint8_t mask = axes_of(tie);
    const Selected selected = resolve(tie.where, body);
    for (const std::uint32_t p : selected.polygons) held.polygon[p] |= mask;
    for (const std::uint32_t e : selected.elements) held.element[e] |= mask;
    held.elements = over_pieces(static_cast<double>(selected.elements.size())) > 0 || held.elements;
  }
  return held;
}

// Calls visit(middle, area [m^2]) for pieces of a polygon that are no longer than a spacing, as long as these are few.
template <class Visit>
void for_each_patch(const Body& body, std::uint32_t polygon, const Visit& visit) {
  constexpr std::size_t kMost = 4096;  // pieces
  const auto corners = body.surface.polygon(polygon);
  const auto at = [&](std::size_t corner) { return body.surface.vertices[corners[corner]]; };
  const double whole = area_vector(body.surface.vertices, corners).norm();
  const double spacing = body.parts[body.surface.polygon_part(polygon)].lattice.spacing.minCoeff();
  const double longest = std::max(spacing, std::sqrt(4 * whole / kMost));
  std::vector<std::array<Vec3, 3>> pending;
  for (std::size_t v = 1; v + 1 < corners.size(); ++v) pending.push_back({at(0), at(v), at(v + 1)});
  while (!pending.empty()) {
    const std::array<Vec3, 3> piece = pending.back();
    pending.pop_back();
    std::size_t edge = 0;
    const auto length = [&](std::size_t e) { return (piece[(e + 1) % 3] - piece[e]).squaredNorm(); };
    for (std::size_t e = 1; e < 3; ++e)
      if (length(e) > length(edge)) edge = e;
    if (length(edge) > longest * longest) {
      const Vec3 middle = 0.5 * (piece[edge] + piece[(edge + 1) % 3]);
      pending.push_back({middle, piece[(edge + 1) % 3], piece[(edge + 2) % 3]});
      pending.push_back({piece[edge], middle, piece[(edge + 2) % 3]});
      continue;
    }
    visit((piece[0] + piece[1] + piece[2]) / 3,
          0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]).norm());
  }
}

// Axes along which the elements under a point of a polygon are held; 0 where the cell there is another process's.
std::uint8_t held_under(const HeldMasks& held, const Body& body, std::uint32_t polygon, const Vec3& point) {
  const auto at = locate_on_surface(body, polygon, point);
  if (!at || !counts_cell(at->cell) || !is_surely_under(body, *at)) return 0;
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
  // What polygons hold all processes know, and the first counts it.
  const bool first = !other_pieces() || other_pieces()->is_first();
  double straight = 0, whole = 0;
  const auto count = [&](const Vec3& along, std::uint8_t mask, bool counts) {
    if (counts) straight += along_axes(along, mask);
    if (counts) whole += along_axes(along, 7);
  };
  for (const std::uint32_t p : selected.polygons) {
    const Vec3 area = area_vector(body.surface.vertices, body.surface.polygon(p));
    const Vec3 along = load.pressure && area.norm() > 0 ? area.normalized() : acting;
    if (!held.elements) {
      count(area.norm() * along, held.polygon[p], first);
      continue;
    }
    for_each_patch(body, p, [&](const Vec3& middle, double piece) {
      count(piece * along, held.polygon[p], first);
      const int more = held_under(held, body, p, middle) & ~held.polygon[p] & 7;
      straight += along_axes(piece * along, static_cast<std::uint8_t>(more));
    });
  }
  for (const std::uint32_t e : selected.elements) count(acting, held.element[e], counts_element(e));
  straight = over_pieces(straight);
  whole = over_pieces(whole);
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

// Axes along which it goes somewhere.
std::uint8_t moving_axes(const Tie& tie) {
  std::uint8_t moving = 0;
  for (int axis = 0; axis < 3; ++axis)
    if ((tie.motion.angle != 0 && std::abs(tie.motion.axis[axis]) < 1 - 1e-9) ||
        tie.motion.translation[axis] != 0)
      moving = static_cast<std::uint8_t>(moving | (axes_of(tie) & 1 << axis));
  return moving;
}

// Axes along which both hold or lead, to different places.
std::uint8_t axes_at_odds(const Tie& one, const Tie& other) {
  const auto both = static_cast<std::uint8_t>(axes_of(one) & axes_of(other));
  const Motion &a = one.motion, &b = other.motion;
  const bool turned = a.angle != 0 || b.angle != 0;
  if (a.translation == b.translation && a.angle == b.angle &&
      (!turned || (a.axis == b.axis && a.through == b.through && a.arc_from == b.arc_from)))
    return 0;
  int odds = turned ? moving_axes(one) | moving_axes(other) : 0;
  for (int axis = 0; axis < 3; ++axis)
    if (a.translation[axis] != b.translation[axis]) odds |= 1 << axis;
  return static_cast<std::uint8_t>(both & odds);
}

// What a tie holds or leads, and where.
struct TiedPlace {
  const Tie& tie;
  const Selected& place;
};

// A surface that is held or led, on elements that are led elsewhere along axes `odds`: neither gets its way.
// (What is led and held by the same kind of selection is refused where ties are made.)
void check_at_odds(const TiedPlace& of_surface, const TiedPlace& of_elements, std::uint8_t odds,
                   const Body& body, Progress& progress) {
  const Tie &surface = of_surface.tie, &elements = of_elements.tie;
  HeldMasks held{{}, std::vector<std::uint8_t>(body.element_count(), 0), true};
  for (const std::uint32_t e : of_elements.place.elements) held.element[e] = axes_of(elements);
  double both = 0, whole = 0;
  for (const std::uint32_t p : of_surface.place.polygons)
    for_each_patch(body, p, [&](const Vec3& middle, double area) {
      if ((held_under(held, body, p, middle) & odds) != 0) both += area;
      whole += area;
    });
  both = over_pieces(both);
  if (!(both > kAtOdds * whole)) return;
  const std::string what = fmt::format(
      "{} \"{}\": a {} of elements {} {} of the place that {}", surface.is_move ? "move" : "fix",
      surface.name, elements.is_move ? "[[move]]" : "[[fix]]", elements.is_move ? "leads" : "holds",
      human_share(both / whole), surface.is_move ? "is to move" : "is held");
  const std::string advice =
      fmt::format("give the {} other elements or axes", elements.is_move ? "move" : "fix");
  if (both > kPartlyHeld * whole) throw InputError(surface.origin, what + "; " + advice);
  progress.warn(fmt::format("{}: {}, and neither gets its way there, at forces that mean nothing; {}",
                            surface.origin, what, advice));
}

// Each with each other one; what a tie selects is looked for once, and only where another is at odds with it.
void check_ties(const std::vector<Tie>& ties, const Body& body, Progress& progress) {
  std::vector<std::optional<Selected>> found(ties.size());
  const auto place = [&](std::size_t n) -> const Selected& {
    if (!found[n]) found[n] = resolve(ties[n].where, body);
    return *found[n];
  };
  for (std::size_t s = 0; s < ties.size(); ++s)
    for (std::size_t e = 0; e < ties.size(); ++e) {
      const std::uint8_t odds = axes_at_odds(ties[s], ties[e]);
      if (odds == 0 || ties[s].link || ties[e].link) continue;
      const bool on_elements = over_pieces(static_cast<double>(place(e).elements.size())) > 0;
      if (place(s).polygons.empty() || !on_elements) continue;
      check_at_odds({ties[s], place(s)}, {ties[e], place(e)}, odds, body, progress);
    }
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
  check_ties(ties, body, progress);
  if (scene.get<Loads>().loads.empty()) return;
  const HeldMasks held = held_masks(ties, body);
  for (const Load& load : scene.get<Loads>().loads) {
    check_held(load, held_share(load, held, body), progress);
    check_side(load, body, progress);
  }
}

}  // namespace flexel::simulate
