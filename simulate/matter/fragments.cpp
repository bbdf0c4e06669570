// Fragments are the firm groups of cells (simulate/matter/firm_groups.h), or what hangs together by the connections
// of centre-placed parts.
#include "simulate/matter/fragments.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/units.h"
#include "formats/lattice/fragments_of_body.h"
#include "simulate/input/scene_words.h"
#include "simulate/matter/firm_groups.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/models/cell_model.h"
#include "simulate/models/cells.h"

namespace flexel::simulate {
namespace {

constexpr double kStrayShare = 1e-3;

bool any_centre(const Body& body) {
  return std::any_of(body.parts.begin(), body.parts.end(),
                     [](const Part& part) { return part.placement == Placement::centre; });
}

Vec3 rest_centre(const Body& body, std::uint32_t cell) {
  Vec3 centre = Vec3::Zero();
  for (const std::uint32_t e : body.cell_elements[cell]) centre += body.rest[e] / 8;
  return centre;
}

void mark_strays(const Body& body, std::vector<Fragment>& fragments) {
  std::vector<double> total(body.parts.size(), 0), largest(body.parts.size(), 0);
  for (const Fragment& fragment : fragments) {
    total[fragment.part] += fragment.volume;
    largest[fragment.part] = std::max(largest[fragment.part], fragment.volume);
  }
  for (Fragment& fragment : fragments)
    fragment.stray =
        fragment.volume < kStrayShare * total[fragment.part] && fragment.volume < largest[fragment.part];
}

std::string near(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

// What is bonded with something that is held is held too.
void hold_bonded(const Fragments& fragments, const std::vector<CoupledElements>& coupled,
                 std::vector<std::uint8_t>& held) {
  DisjointSets sets(held.size());
  for (const CoupledElements& group : coupled)
    for (const std::uint32_t e : group)
      sets.unite(fragments.of_element[group.front()], fragments.of_element[e]);
  std::vector<std::uint8_t> group(held.size(), 0);
  for (std::uint32_t f = 0; f < held.size(); ++f)
    if (held[f]) group[sets.root(f)] = 1;
  for (std::uint32_t f = 0; f < held.size(); ++f) held[f] = group[sets.root(f)];
}

// The cell of simulated matter whose centre is nearest to `point`, in `part`.
std::uint32_t nearest_cell(const Fragments& fragments, const Body& body, std::uint32_t part,
                           const Vec3& point) {
  std::uint32_t nearest = kNoFragment;
  double least = 1e300;
  for (std::uint32_t c = body.parts[part].cell_begin; c < body.parts[part].cell_end; ++c) {
    if (fragments.of_cell[c] == kNoFragment || fragments.list[fragments.of_cell[c]].stray) continue;
    const double squared_distance = (rest_centre(body, c) - point).squaredNorm();
    if (squared_distance < least) {
      least = squared_distance;
      nearest = c;
    }
  }
  return nearest;
}

void add_matter(double volume, const Vec3& at, Fragment& fragment) {
  ++fragment.size;
  fragment.volume += volume;
  fragment.centre += volume * at;
}

// The element of simulated matter that rests nearest to `point`, in a centre-placed part.
std::uint32_t nearest_simulated(const Problem& problem, const Part& part, const Vec3& point) {
  std::uint32_t nearest = kNoFragment;
  double least = 1e300;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
    if (problem.stray_element[e]) continue;
    const double squared_distance = (problem.body.rest[e] - point).squaredNorm();
    if (squared_distance < least) {
      least = squared_distance;
      nearest = e;
    }
  }
  return nearest;
}

void carry_stray_elements(const Problem& problem, State& state) {
  for (const Part& part : problem.body.parts) {
    if (part.placement == Placement::corner) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      if (!problem.stray_element[e]) continue;
      const std::uint32_t nearest = nearest_simulated(problem, part, problem.body.rest[e]);
      if (nearest == kNoFragment) continue;
      const InterpolationWeights carrier = with_gradient(problem, {{nearest}, {1}, 1}, problem.body.rest[e]);
      state.displacement[e] = Vec3::Zero();
      for (std::uint32_t a = 0; a < carrier.count; ++a)
        state.displacement[e] += carrier.weights[a] * state.displacement[carrier.elements[a]];
    }
  }
}

// Of the elements that several fragments share, one that is simulated has them.
void number_elements(const Body& body, Fragments& found) {
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    const std::uint32_t which = found.of_cell[c];
    if (which == kNoFragment) continue;
    for (const std::uint32_t e : body.cell_elements[c]) {
      std::uint32_t& own = found.of_element[e];
      if (own != kNoFragment && own != which) {
        found.list[own].hinged = found.list[which].hinged = true;
        if (found.list[which].stray) continue;
      }
      own = which;
    }
  }
}

}  // namespace

Fragments find_fragments(const Body& body) {
  Fragments found;
  DisjointSets sets = any_centre(body) ? connected_elements(element_adjacency(body)) : DisjointSets();
  std::vector<std::uint32_t> number(body.element_count(), kNoFragment);
  found.of_cell = firm_groups(body);
  found.of_element.assign(body.element_count(), kNoFragment);
  const std::vector<std::uint32_t> part = cell_parts(body);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    const std::uint32_t which = found.of_cell[c];
    if (which == kNoFragment) continue;
    if (which == found.list.size()) found.list.push_back({part[c]});
    add_matter(body.fill[c] * body.parts[part[c]].lattice.spacing.prod(), rest_centre(body, c),
               found.list[which]);
  }
  for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
    const Part& placed = body.parts[p];
    if (placed.placement == Placement::corner) continue;
    for (std::uint32_t e = placed.element_begin; e < placed.element_end; ++e) {
      std::uint32_t& which = number[sets.root(e)];
      if (which == kNoFragment) {
        which = static_cast<std::uint32_t>(found.list.size());
        found.list.push_back({p});
      }
      add_matter(placed.lattice.spacing.prod(), body.rest[e], found.list[which]);
      found.of_element[e] = which;
    }
  }
  for (Fragment& fragment : found.list) fragment.centre /= fragment.volume;
  mark_strays(body, found.list);
  number_elements(body, found);
  return found;
}

std::vector<std::uint8_t> stray_cells(const Fragments& fragments) {
  std::vector<std::uint8_t> stray(fragments.of_cell.size(), 0);
  for (std::size_t c = 0; c < stray.size(); ++c)
    stray[c] = fragments.of_cell[c] != kNoFragment && fragments.list[fragments.of_cell[c]].stray;
  return stray;
}

std::vector<std::uint8_t> stray_elements(const Fragments& fragments, const Body& body) {
  std::vector<std::uint8_t> stray(body.element_count(), 0);
  for (const Part& part : body.parts)
    if (part.placement == Placement::centre)
      for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
        stray[e] = fragments.list[fragments.of_element[e]].stray;
  return stray;
}

void refuse_loose_fragments(const Fragments& fragments, const Body& body,
                            const std::vector<std::uint8_t>& tied_elements,
                            const std::vector<CoupledElements>& coupled, const std::string& scene) {
  if (fragments.list.empty())
    throw InputError(scene,
                     "every cell of the body is broken: nothing is left that resists a load, so there is no "
                     "equilibrium; take the body from before it broke");
  std::vector<std::uint8_t> held(fragments.list.size(), 0);
  std::vector<std::size_t> fragments_of_part(body.parts.size(), 0);
  for (std::size_t e = 0; e < tied_elements.size(); ++e)
    if (tied_elements[e] && fragments.of_element[e] != kNoFragment) held[fragments.of_element[e]] = 1;
  for (std::size_t c = 0; c < fragments.of_cell.size(); ++c)  // shared elements are of one fragment alone
    if (fragments.of_cell[c] != kNoFragment)
      for (const std::uint32_t e : body.cell_elements[c])
        if (tied_elements[e]) held[fragments.of_cell[c]] = 1;
  hold_bonded(fragments, coupled, held);
  for (const Fragment& fragment : fragments.list) fragments_of_part[fragment.part] += !fragment.stray;
  const SceneWords words = words_of(scene);
  for (std::size_t f = 0; f < fragments.list.size(); ++f) {
    const Fragment& fragment = fragments.list[f];
    if (held[f] || fragment.stray) continue;
    const std::string& part = body.parts[fragment.part].name;
    if (fragments_of_part[fragment.part] == 1)
      throw InputError(
          scene, fmt::format("nothing holds part \"{}\": it is free to translate and to rotate; add {}", part,
                             words.a_fix));
    throw InputError(
        scene,
        fmt::format("part \"{}\" is in {} pieces that are not {}connected; the one of {} {} near {} hangs "
                    "{}: fix it too, or {} if it should be joined{}",
                    part, fragments_of_part[fragment.part], fragment.hinged ? "firmly " : "",
                    human_count(fragment.size),
                    body.parts[fragment.part].placement == Placement::centre ? "elements" : "cells",
                    near(fragment.centre),
                    fragment.hinged ? "on the rest by edges and corners of cells alone, which let it turn"
                                    : "on nothing",
                    words.a_finer_size, fragment.hinged ? "" : " (over a gap: --heal wrap)"));
  }
}

std::vector<std::uint8_t> lone_elements(const Problem& problem) {
  std::vector<std::uint8_t> lone(problem.body.element_count(), 1);
  const std::vector<std::uint8_t> active = active_cells(problem);
  for (std::size_t c = 0; c < active.size(); ++c)
    if (active[c])
      for (const std::uint32_t e : problem.body.cell_elements[c]) lone[e] = 0;
  return lone;
}

void carry_strays(const Fragments& fragments, const Problem& problem, const Stencil& stencil, State& state) {
  std::vector<std::uint8_t> lone(problem.body.element_count());
  for (std::uint32_t e = 0; e < lone.size(); ++e) lone[e] = stencil.of(e).empty();
  carry_strays(fragments, problem, lone, state);
}

void carry_strays(const Fragments& fragments, const Problem& problem, const std::vector<std::uint8_t>& lone,
                  State& state) {
  const Body& body = problem.body;
  carry_stray_elements(problem, state);
  struct Way {
    Vec3 centre = Vec3::Zero(), displacement = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
  };
  const auto carrier_near = [&](std::uint32_t part, const Vec3& point) {
    Way carrier;
    const std::uint32_t cell = nearest_cell(fragments, body, part, point);
    if (cell == kNoFragment) return carrier;
    CellVectors u;
    for (std::size_t a = 0; a < 8; ++a) {
      u[a] = state.displacement[body.cell_elements[cell][a]];
      carrier.displacement += u[a] / 8;
    }
    carrier.centre = rest_centre(body, cell);
    carrier.gradient =
        displacement_gradient(cell_kind(body.parts[part].lattice, Material{"", 1, 0, 1, ""}), u);
    return carrier;
  };
  std::vector<Way> of_fragment(fragments.list.size());
  for (std::size_t f = 0; f < fragments.list.size(); ++f)
    if (fragments.list[f].stray && body.parts[fragments.list[f].part].placement == Placement::corner)
      of_fragment[f] = carrier_near(fragments.list[f].part, fragments.list[f].centre);
  const std::vector<std::uint32_t> part = element_parts(body);
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    if (body.parts[part[e]].placement == Placement::centre || !lone[e]) continue;
    const std::uint32_t f = fragments.of_element[e];
    const Way carrier = f == kNoFragment ? carrier_near(part[e], body.rest[e]) : of_fragment[f];
    state.displacement[e] = carrier.displacement + carrier.gradient * (body.rest[e] - carrier.centre);
  }
}

}  // namespace flexel::simulate
