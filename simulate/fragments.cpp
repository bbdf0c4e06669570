// Fragments by union-find over the elements of whole cells; the smaller index is the root, so the numbering
// is repeatable.
#include "simulate/fragments.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "formats/error.h"
#include "formats/units.h"
#include "simulate/cell_model.h"

namespace flexel {
namespace {

constexpr double kStrayShare = 1e-3;

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t e) {
  while (parent[e] != e) {
    parent[e] = parent[parent[e]];
    e = parent[e];
  }
  return e;
}

bool whole(const Body& body, std::size_t cell) {
  return !(cell < body.broken.size() && body.broken[cell]);
}

std::vector<std::uint32_t> joined_elements(const Body& body) {
  std::vector<std::uint32_t> parent(body.element_count());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(body, c)) continue;
    for (std::size_t a = 1; a < 8; ++a) {
      const std::uint32_t x = root_of(parent, body.cell_elements[c][0]),
                          y = root_of(parent, body.cell_elements[c][a]);
      parent[std::max(x, y)] = std::min(x, y);
    }
  }
  return parent;
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
void hold_bonded(const Fragments& fragments, const std::vector<CellPair>& coupled,
                 std::vector<std::uint8_t>& held) {
  std::vector<std::uint32_t> parent(held.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const auto& [a, b] : coupled) {
    const std::uint32_t x = root_of(parent, fragments.of_cell[a]), y = root_of(parent, fragments.of_cell[b]);
    parent[std::max(x, y)] = std::min(x, y);
  }
  std::vector<std::uint8_t> group(held.size(), 0);
  for (std::uint32_t f = 0; f < held.size(); ++f)
    if (held[f]) group[root_of(parent, f)] = 1;
  for (std::uint32_t f = 0; f < held.size(); ++f) held[f] = group[root_of(parent, f)];
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

}  // namespace

Fragments find_fragments(const Body& body) {
  Fragments found;
  std::vector<std::uint32_t> parent = joined_elements(body);
  std::vector<std::uint32_t> number(body.element_count(), kNoFragment);
  found.of_cell.assign(body.cell_count(), kNoFragment);
  found.of_element.assign(body.element_count(), kNoFragment);
  const std::vector<std::uint32_t> part = cell_parts(body);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(body, c)) continue;
    std::uint32_t& which = number[root_of(parent, body.cell_elements[c][0])];
    if (which == kNoFragment) {
      which = static_cast<std::uint32_t>(found.list.size());
      found.list.push_back({part[c]});
    }
    Fragment& fragment = found.list[which];
    const double volume = body.fill[c] * body.parts[part[c]].lattice.spacing.prod();
    ++fragment.cells;
    fragment.volume += volume;
    fragment.centre += volume * rest_centre(body, c);
    found.of_cell[c] = which;
    for (const std::uint32_t e : body.cell_elements[c]) found.of_element[e] = which;
  }
  for (Fragment& fragment : found.list) fragment.centre /= fragment.volume;
  mark_strays(body, found.list);
  return found;
}

std::vector<std::uint8_t> stray_cells(const Fragments& fragments) {
  std::vector<std::uint8_t> stray(fragments.of_cell.size(), 0);
  for (std::size_t c = 0; c < stray.size(); ++c)
    stray[c] = fragments.of_cell[c] != kNoFragment && fragments.list[fragments.of_cell[c]].stray;
  return stray;
}

void refuse_loose_fragments(const Fragments& fragments, const Body& body,
                            const std::vector<std::uint8_t>& tied_elements,
                            const std::vector<CellPair>& coupled, const std::string& scene) {
  std::vector<std::uint8_t> held(fragments.list.size(), 0);
  std::vector<std::size_t> fragments_of_part(body.parts.size(), 0);
  for (std::size_t e = 0; e < tied_elements.size(); ++e)
    if (tied_elements[e] && fragments.of_element[e] != kNoFragment) held[fragments.of_element[e]] = 1;
  hold_bonded(fragments, coupled, held);
  for (const Fragment& fragment : fragments.list) fragments_of_part[fragment.part] += !fragment.stray;
  for (std::size_t f = 0; f < fragments.list.size(); ++f) {
    const Fragment& fragment = fragments.list[f];
    if (held[f] || fragment.stray) continue;
    const std::string& part = body.parts[fragment.part].name;
    if (fragments_of_part[fragment.part] == 1)
      throw InputError(
          scene,
          fmt::format("nothing holds part \"{}\": it is free to translate and to rotate; add a [[fix]]",
                      part));
    throw InputError(
        scene,
        fmt::format("part \"{}\" is in {} pieces that are not connected; the one of {} cells near {} hangs "
                    "on nothing: fix it too, or voxelize with a smaller spacing if it should be joined",
                    part, fragments_of_part[fragment.part], human_count(fragment.cells),
                    near(fragment.centre)));
  }
}

void carry_strays(const Fragments& fragments, const Body& body, const Stencil& stencil, State& state) {
  struct Carrier {
    Vec3 centre = Vec3::Zero(), displacement = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
  };
  const auto carrier_near = [&](std::uint32_t part, const Vec3& point) {
    Carrier carrier;
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
  std::vector<Carrier> of_fragment(fragments.list.size());
  for (std::size_t f = 0; f < fragments.list.size(); ++f)
    if (fragments.list[f].stray)
      of_fragment[f] = carrier_near(fragments.list[f].part, fragments.list[f].centre);
  const std::vector<std::uint32_t> part = element_parts(body);
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    if (!stencil.of(e).empty()) continue;
    const std::uint32_t f = fragments.of_element[e];
    const Carrier carrier = f == kNoFragment ? carrier_near(part[e], body.rest[e]) : of_fragment[f];
    state.displacement[e] = carrier.displacement + carrier.gradient * (body.rest[e] - carrier.centre);
  }
}

}  // namespace flexel
