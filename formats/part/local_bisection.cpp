// Rivara's longest-edge propagation (M.-C. Rivara, "New longest-edge algorithms for the refinement and/or improvement of
// unstructured triangulations", 1997): from the triangle asked for, the way goes to a neighbour across the longest edge
// for as long as that has a longer one. At its end the edge is the longest of every triangle that has it, so all of
// them are bisected at its midpoint and the mesh conforms after each step. The way ends, for edges are in a strict
// order. Angles do not fall below half the smallest there was (Rosenberg and Stenger, 1975).
#include "formats/part/local_bisection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "formats/part/near_weld.h"
#include "formats/part/topology.h"

namespace flexel {

LocalBisection::LocalBisection(const Surface& surface)
    : vertices_before_(static_cast<std::uint32_t>(surface.vertices.size())),
      vertices_(surface.vertices),
      is_split_(surface.polygon_count(), 0) {
  Triangles triangles = triangulate(surface);
  welded_ = weld_parts(surface, triangles);
  triangles_ = std::move(triangles.corners);
  polygon_ = std::move(triangles.polygon);
  users_.reserve(triangles_.size() * 3 / 2);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    if (!has_area(t)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Edge each = edge(t, i);
      users_[key(each.a, each.b)].push_back(t);
    }
  }
}

LocalBisection::Edge LocalBisection::edge(std::uint32_t triangle, std::size_t corner) const {
  const Corners& at = triangles_[triangle];
  const std::uint32_t a = welded_[at.at(corner)], b = welded_[at.at((corner + 1) % 3)];
  return {(vertices_[a] - vertices_[b]).squaredNorm(), std::min(a, b), std::max(a, b)};
}

LocalBisection::Edge LocalBisection::longest(std::uint32_t triangle) const {
  Edge result = edge(triangle, 0);
  for (std::size_t i = 1; i < 3; ++i)
    if (const Edge each = edge(triangle, i); each.is_longer_than(result)) result = each;
  return result;
}

double LocalBisection::longest_edge(std::uint32_t triangle) const {
  return std::sqrt(longest(triangle).length2);
}

bool LocalBisection::has_area(std::uint32_t triangle) const {
  const Corners& at = triangles_[triangle];
  return welded_[at[0]] != welded_[at[1]] && welded_[at[1]] != welded_[at[2]] &&
         welded_[at[2]] != welded_[at[0]];
}

std::uint8_t LocalBisection::unshared(std::uint32_t triangle) const {
  std::uint8_t edges = 0;
  if (!has_area(triangle)) return edges;
  for (std::size_t i = 0; i < 3; ++i) {
    const Edge each = edge(triangle, i);
    if (users_.at(key(each.a, each.b)).size() != 2) edges |= static_cast<std::uint8_t>(1u << i);
  }
  return edges;
}

bool LocalBisection::bisect(std::uint32_t triangle) {
  if (!has_area(triangle)) return false;
  std::vector<std::uint32_t> way{triangle};
  while (!way.empty()) {
    const Edge own = longest(way.back());
    const std::vector<std::uint32_t>& users = users_.at(key(own.a, own.b));
    const auto longer =
        std::find_if(users.begin(), users.end(), [&](std::uint32_t t) { return !(longest(t) == own); });
    if (longer != users.end()) {
      way.push_back(*longer);
      continue;
    }
    split_edge(own);
    way.pop_back();
  }
  return true;
}

void LocalBisection::split_edge(const Edge& edge) {
  const auto entry = users_.find(key(edge.a, edge.b));
  const std::vector<std::uint32_t> users = std::move(entry->second);
  users_.erase(entry);
  std::uint32_t first = kNoTriangle;  // of the new vertices here, which all are at one position
  for (const std::uint32_t t : users) split(t, edge, first);
}

std::uint32_t LocalBisection::middle(std::uint32_t a, std::uint32_t b, std::uint32_t& first) {
  const auto added = static_cast<std::uint32_t>(vertices_.size());
  const auto [found, is_new] = middles_.emplace(key(a, b), added);
  if (!is_new) return found->second;
  vertices_.push_back(0.5 * (vertices_[a] + vertices_[b]));
  ends_.push_back({std::min(a, b), std::max(a, b)});
  if (first == kNoTriangle) first = added;
  welded_.push_back(first);
  return added;
}

// Triangle (a, b, c), bisected at the middle m of a b, becomes (a, m, c) and a new (m, b, c).
void LocalBisection::split(std::uint32_t triangle, const Edge& edge, std::uint32_t& first) {
  std::size_t i = 0;
  while (!(this->edge(triangle, i) == edge)) ++i;
  const Corners old = triangles_[triangle];
  const std::uint32_t a = old.at(i), b = old.at((i + 1) % 3), c = old.at((i + 2) % 3),
                      m = middle(a, b, first);
  const auto added = static_cast<std::uint32_t>(triangles_.size());
  triangles_[triangle] = {a, m, c};
  triangles_.push_back({m, b, c});
  polygon_.push_back(polygon_[triangle]);
  is_split_[polygon_[triangle]] = 1;
  const auto use = [&](std::uint32_t u, std::uint32_t v, std::uint32_t t) {
    users_[key(welded_[u], welded_[v])].push_back(t);
  };
  std::vector<std::uint32_t>& moved = users_.at(key(welded_[b], welded_[c]));
  std::replace(moved.begin(), moved.end(), triangle, added);
  use(a, m, triangle);
  use(m, b, added);
  use(m, c, triangle);
  use(m, c, added);
  changed_.push_back(triangle);
  changed_.push_back(added);
}

std::vector<std::uint32_t> LocalBisection::take_changed() {
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  return std::exchange(changed_, {});
}

Refinement LocalBisection::refinement(const Surface& surface) const {
  Refinement result;
  result.vertices = vertices_before_;
  result.ends = ends_;
  std::vector<std::uint32_t> order(triangles_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t s, std::uint32_t t) { return polygon_[s] < polygon_[t]; });
  const auto add = [&](std::uint32_t polygon, std::span<const std::uint32_t> corners) {
    result.corners.insert(result.corners.end(), corners.begin(), corners.end());
    result.offsets.push_back(static_cast<std::uint32_t>(result.corners.size()));
    result.origin.push_back(polygon);
  };
  for (const std::uint32_t t : order) {
    const std::uint32_t p = polygon_[t];
    if (is_split_[p])
      add(p, triangles_[t]);
    else if (result.origin.empty() || result.origin.back() != p)
      add(p, surface.polygon(p));
  }
  return result;
}

}  // namespace flexel
