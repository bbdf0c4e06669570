// Damage as files have it, done to clean meshes: repeatable by its seed.
#pragma once
#include <algorithm>
#include <numeric>
#include <set>
#include <string>

#include "tests/voxelize/shapes.h"

namespace flexel::voxelize::shapes {

inline constexpr const char* kDamages[] = {"missing",
                                           "flipped",
                                           "fins",
                                           "soup",
                                           "float cracks",
                                           "repeated",
                                           "missing and flipped",
                                           "patch cut out",
                                           "sheets inside",
                                           "lost face",
                                           "soup, flipped",
                                           "inside out, fins"};
inline constexpr int kDamageCount = 12;

class Damager {
 public:
  Damager(Mesh mesh, unsigned seed) : mesh_(std::move(mesh)), random_(seed) {
    Box box;
    for (const Vec3& v : mesh_.vertices) box.add(v);
    box_ = box;
  }

  // `degree` from 0 (as the acceptance test has it) to 1 (far worse).
  Mesh damaged(int kind, double degree) {
    switch (kind) {
      case 0:
        missing(.005 + .045 * degree);
        break;
      case 1:
        flipped(.1 + .3 * degree);
        break;
      case 2:
        fins(.005 + .05 * degree);
        break;
      case 3:
        soup(std::pow(10, -6 + 3 * degree));
        break;
      case 4:
        soup(std::pow(10, -9 + 1.5 * degree));
        break;
      case 5:
        repeated(.01 + .2 * degree);
        break;
      case 6:
        missing(.005 + .01 * degree), flipped(.1 + .1 * degree);
        break;
      case 7:
        cut_out(.002 + .1 * degree);
        break;
      case 8:
        sheets(1 + static_cast<int>(20 * degree));
        break;
      case 9:
        lose_face();
        break;
      case 10:
        flipped(.02 + .3 * degree), soup(std::pow(10, -6 + 3 * degree));
        break;
      default:
        flip_all(), fins(.005 + .02 * degree);
        break;
    }
    return mesh_;
  }

 private:
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Vec3 direction() {
    std::normal_distribution<double> normal;
    return Vec3(normal(random_), normal(random_), normal(random_)).normalized();
  }
  void missing(double share) {
    std::erase_if(mesh_.triangles, [&](const auto&) { return chance() < share; });
  }
  void flipped(double share) {
    for (auto& t : mesh_.triangles)
      if (chance() < share) std::swap(t[1], t[2]);
  }
  void flip_all() {
    for (auto& t : mesh_.triangles) std::swap(t[1], t[2]);
  }
  // Triangles that stand on an edge and end in nothing.
  void fins(double share) {
    const std::size_t n = mesh_.triangles.size();
    for (std::size_t t = 0; t < n; ++t) {
      if (chance() >= share) continue;
      const auto c = mesh_.triangles[t];
      const Vec3 &a = mesh_.vertices[c[0]], &b = mesh_.vertices[c[1]];
      mesh_.vertices.push_back((a + b) / 2 + direction() * (b - a).norm() * (.2 + chance()));
      mesh_.triangles.push_back({c[0], c[1], static_cast<std::uint32_t>(mesh_.vertices.size() - 1)});
    }
  }
  // Every triangle by itself, its corners moved by up to `amplitude` of the diagonal.
  void soup(double amplitude) {
    Mesh apart;
    for (const auto& t : mesh_.triangles) {
      const auto first = static_cast<std::uint32_t>(apart.vertices.size());
      for (const std::uint32_t v : t)
        apart.vertices.push_back(mesh_.vertices[v] + direction() * chance() * amplitude * box_.diagonal());
      apart.triangles.push_back({first, first + 1, first + 2});
    }
    mesh_ = apart;
  }
  void repeated(double share) {
    const std::size_t n = mesh_.triangles.size();
    for (std::size_t t = 0; t < n; ++t)
      for (int copies = 1 + static_cast<int>(2 * chance()); copies > 0 && chance() < share; --copies) {
        auto c = mesh_.triangles[t];
        if (chance() < .3) std::swap(c[1], c[2]);
        mesh_.triangles.push_back(c);
      }
  }
  // A patch around one triangle, this share of all triangles.
  void cut_out(double share) {
    const auto middle = [&](const std::array<std::uint32_t, 3>& t) {
      return Vec3((mesh_.vertices[t[0]] + mesh_.vertices[t[1]] + mesh_.vertices[t[2]]) / 3);
    };
    const Vec3 at = middle(mesh_.triangles[random_() % mesh_.triangles.size()]);
    std::sort(mesh_.triangles.begin(), mesh_.triangles.end(), [&](const auto& a, const auto& b) {
      return (middle(a) - at).squaredNorm() < (middle(b) - at).squaredNorm();
    });
    mesh_.triangles.erase(
        mesh_.triangles.begin(),
        mesh_.triangles.begin() +
            std::max<std::ptrdiff_t>(
                1, static_cast<std::ptrdiff_t>(share * static_cast<double>(mesh_.triangles.size()))));
  }
  // Triangles across the box, of no surface.
  void sheets(int count) {
    for (int n = 0; n < count; ++n) {
      const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
      const Vec3 at = box_.min + box_.size().cwiseProduct(Vec3(chance(), chance(), chance()));
      for (int c = 0; c < 3; ++c) mesh_.vertices.push_back(at + direction() * .1 * box_.diagonal());
      mesh_.triangles.push_back({first, first + 1, first + 2});
    }
  }
  // All triangles that are connected with one and within 20 degrees of their neighbours, up to a tenth of all
  // (a smooth shell would vanish as a whole, which nothing can tell).
  void lose_face() {
    const auto normal = [&](const std::array<std::uint32_t, 3>& t) {
      return Vec3((mesh_.vertices[t[1]] - mesh_.vertices[t[0]])
                      .cross(mesh_.vertices[t[2]] - mesh_.vertices[t[0]])
                      .normalized());
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> at_edge;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      for (int e = 0; e < 3; ++e) {
        const auto [a, b] = std::minmax(mesh_.triangles[t][e], mesh_.triangles[t][(e + 1) % 3]);
        at_edge[{a, b}].push_back(t);
      }
    std::vector<std::size_t> region{random_() % mesh_.triangles.size()};
    std::set<std::size_t> seen{region[0]};
    for (std::size_t n = 0; n < region.size() && 10 * region.size() < mesh_.triangles.size(); ++n)
      for (int e = 0; e < 3; ++e) {
        const auto& c = mesh_.triangles[region[n]];
        const auto [a, b] = std::minmax(c[e], c[(e + 1) % 3]);
        for (const std::size_t other : at_edge[{a, b}])
          if (!seen.count(other) && normal(c).dot(normal(mesh_.triangles[other])) > .94) {
            seen.insert(other);
            region.push_back(other);
          }
      }
    std::vector<std::array<std::uint32_t, 3>> rest;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      if (!seen.count(t)) rest.push_back(mesh_.triangles[t]);
    mesh_.triangles = rest;
  }

  Mesh mesh_;
  std::mt19937 random_;
  Box box_;
};

}  // namespace flexel::voxelize::shapes
