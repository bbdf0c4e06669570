// Cells that share a face hold together. Of what that leaves, groups that share three elements or more which
// do not lie in a line do so too, and so on until nothing more joins. What then still hangs together in
// corners and along edges may be firm all the same (three plates around a corner): it is where the rigid
// motions of its groups that keep all shared elements together are those of one rigid body. With r of
// element x from the middle of all, group g moves it by t_g + w_g x r, and the motions sought are the null
// space of the sum of |d|^2 over every two groups at every shared element, d the difference of theirs.
#include "simulate/matter/firm_groups.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "base/disjoint_sets.h"
#include "base/math/dense.h"
#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kMostGroups = 40;  // that one null space is sought of
constexpr double kInLine = 1e-6;         // of the extent: how far elements in a line lie from it
constexpr double kNoEnergy = 1e-9;       // of the largest eigenvalue

bool whole(const Body& body, std::size_t cell) {
  return !(cell < body.broken.size() && body.broken[cell]);
}

// Elements of the cell's face at the low (0) or high (1) end of `axis`, in the same order at both.
std::array<std::uint32_t, 4> face(const std::array<std::uint32_t, 8>& cell, std::size_t axis,
                                  std::size_t high) {
  std::array<std::uint32_t, 4> elements{};
  for (std::size_t a = 0, n = 0; a < 8; ++a)
    if ((a >> axis & 1) == high) elements[n++] = cell[a];
  return elements;
}

// The cell beyond a face begins at the face's first element.
void join_faces(const Body& body, DisjointSets& sets) {
  std::vector<std::uint32_t> first(body.element_count(), kNoGroup), next(body.cell_count(), kNoGroup);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(body, c)) continue;
    next[c] = first[body.cell_elements[c][0]];
    first[body.cell_elements[c][0]] = c;
  }
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(body, c)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::array<std::uint32_t, 4> high = face(body.cell_elements[c], axis, 1);
      for (std::uint32_t other = first[high[0]]; other != kNoGroup; other = next[other])
        if (face(body.cell_elements[other], axis, 0) == high) sets.unite(c, other);
    }
  }
}

std::vector<std::uint32_t> numbered(const Body& body, DisjointSets& sets) {
  std::vector<std::uint32_t> number(body.cell_count(), kNoGroup), result(body.cell_count(), kNoGroup);
  std::uint32_t count = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(body, c)) continue;
    std::uint32_t& own = number[sets.root(c)];
    if (own == kNoGroup) own = count++;
    result[c] = own;
  }
  return result;
}

struct SharedElement {
  std::uint32_t element = 0;
  std::vector<std::uint32_t> groups;  // two or more, ascending
};

std::vector<SharedElement> shared_elements(const Body& body, const std::vector<std::uint32_t>& group) {
  std::vector<std::uint32_t> seen(body.element_count(), kNoGroup);
  std::map<std::uint32_t, std::vector<std::uint32_t>> found;
  for (std::size_t c = 0; c < group.size(); ++c) {
    if (group[c] == kNoGroup) continue;
    for (const std::uint32_t e : body.cell_elements[c]) {
      if (seen[e] == kNoGroup) seen[e] = group[c];
      if (seen[e] != group[c]) found[e].insert(found[e].end(), {seen[e], group[c]});
    }
  }
  std::vector<SharedElement> result;
  for (auto& [element, groups] : found) {
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    result.push_back({element, std::move(groups)});
  }
  return result;
}

bool in_line(const std::vector<Vec3>& points) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : points) spread += (p - middle) * (p - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[1] <= kInLine * kInLine * eigen.eigenvalues()[2];
}

// Joins groups whose shared elements span a plane; true when any did. `cell_of`: a cell of each group.
bool join_planes(const Body& body, const std::vector<SharedElement>& shared,
                 const std::vector<std::uint32_t>& cell_of, DisjointSets& sets) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Vec3>> between;
  for (const SharedElement& each : shared)
    for (std::size_t a = 0; a < each.groups.size(); ++a)
      for (std::size_t b = a + 1; b < each.groups.size(); ++b)
        between[{each.groups[a], each.groups[b]}].push_back(body.rest[each.element]);
  bool joined = false;
  for (const auto& [pair, points] : between) {
    if (in_line(points)) continue;
    sets.unite(cell_of[pair.first], cell_of[pair.second]);
    joined = true;
  }
  return joined;
}

using Joints = std::vector<const SharedElement*>;

// Energy of relative motions at the joints of `groups` (ascending), six motions a group; a joint counts among
// those of its groups that are in the list. Rigid motions are about `middle`, lengths in units of `reach`.
Eigen::MatrixXd joint_energy(const Body& body, const std::vector<std::uint32_t>& groups, const Joints& joints,
                             const Vec3& middle, double reach) {
  const auto size = 6 * static_cast<Eigen::Index>(groups.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  for (const SharedElement* joint : joints) {
    std::vector<Eigen::Index> place;
    for (const std::uint32_t g : joint->groups)
      if (const auto at = std::lower_bound(groups.begin(), groups.end(), g); at != groups.end() && *at == g)
        place.push_back(6 * (at - groups.begin()));
    const Vec3 r = (body.rest[joint->element] - middle) / reach;
    Eigen::Matrix<double, 3, 6> moves;
    moves << 1, 0, 0, 0, r[2], -r[1], 0, 1, 0, -r[2], 0, r[0], 0, 0, 1, r[1], -r[0], 0;
    const Eigen::Matrix<double, 6, 6> own = moves.transpose() * moves;
    for (std::size_t a = 0; a < place.size(); ++a)
      for (std::size_t b = a + 1; b < place.size(); ++b) {
        sum.block<6, 6>(place[a], place[a]) += own;
        sum.block<6, 6>(place[b], place[b]) += own;
        sum.block<6, 6>(place[a], place[b]) -= own;
        sum.block<6, 6>(place[b], place[a]) -= own;
      }
  }
  return sum;
}

// The first group that could move with every other one held: it says nothing of the others.
std::optional<std::size_t> loose_group(const Eigen::MatrixXd& energy) {
  const double least = kNoEnergy * energy.diagonal().maxCoeff();
  for (Eigen::Index g = 0; g + 6 <= energy.rows(); g += 6) {
    if (eigenvalues_symmetric_6(energy.block<6, 6>(g, g))[0] <= least) return static_cast<std::size_t>(g / 6);
  }
  return std::nullopt;
}

// Joins groups that hang together, directly or by others, where that is firm as a whole.
void join_frames(const Body& body, const std::vector<SharedElement>& shared,
                 const std::vector<std::uint32_t>& cell_of, DisjointSets& sets) {
  DisjointSets hang(cell_of.size());
  for (const SharedElement& each : shared)
    for (const std::uint32_t g : each.groups) hang.unite(each.groups.front(), g);
  std::map<std::uint32_t, std::vector<std::uint32_t>> frames;
  for (std::uint32_t g = 0; g < cell_of.size(); ++g) frames[hang.root(g)].push_back(g);
  std::map<std::uint32_t, Joints> joints;
  for (const SharedElement& each : shared) joints[hang.root(each.groups.front())].push_back(&each);
  for (auto& [root, groups] : frames) {
    if (groups.size() < 3 || groups.size() > kMostGroups) continue;
    Box box;
    for (const SharedElement* joint : joints[root]) box.add(body.rest[joint->element]);
    const double reach = box.diagonal();
    if (!(reach > 0)) continue;  // one joint: they turn about it
    Eigen::MatrixXd energy = joint_energy(body, groups, joints[root], 0.5 * (box.min + box.max), reach);
    for (auto loose = loose_group(energy); loose && groups.size() > 2; loose = loose_group(energy)) {
      groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(*loose));
      energy = joint_energy(body, groups, joints[root], 0.5 * (box.min + box.max), reach);
    }
    if (groups.size() < 3) continue;
    const Eigen::VectorXd energies = eigenvalues_symmetric(energy);
    if (energies[6] <= kNoEnergy * energies[energies.size() - 1])
      continue;  // more than the six of one rigid body
    for (const std::uint32_t g : groups) sets.unite(cell_of[groups.front()], cell_of[g]);
  }
}

}  // namespace

std::vector<std::uint32_t> firm_groups(const Body& body) {
  DisjointSets sets(body.cell_count());
  join_faces(body, sets);
  for (bool last = false;;) {
    std::vector<std::uint32_t> group = numbered(body, sets);
    std::vector<std::uint32_t> cell_of;
    for (std::uint32_t c = 0; c < group.size(); ++c)
      if (group[c] == cell_of.size()) cell_of.push_back(c);
    if (cell_of.size() <= 1 || last) return group;
    const std::vector<SharedElement> shared = shared_elements(body, group);
    if (shared.empty()) return group;
    if (join_planes(body, shared, cell_of, sets)) continue;
    join_frames(body, shared, cell_of, sets);
    last = true;
  }
}

}  // namespace flexel::simulate
