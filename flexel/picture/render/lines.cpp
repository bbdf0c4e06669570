// Each edge is cut into pieces of a pixel and a half, a ray tests whether the camera sees each piece, and
// runs of visible pieces are drawn as one anti-aliased line.
#include "flexel/picture/render/lines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/program/share_scope.h"

namespace flexel::picture {
namespace {

constexpr float kPiece = 1.5f;      // pixels
constexpr float kLineLift = 3e-4f;  // towards the camera, of the part's radius
constexpr float kDrop = 0.012f;     // beside an outline
constexpr int kMostPieces = 4000;

struct Edge {
  Vec3f from, to;
  std::array<std::uint32_t, 2> vertices;
  LineKind kind;
  bool sharp;  // an outline that is a crease where the view does not fall away beside it
};

// Every triangle's direction: 1 faces the camera; one that is seen edge-on does not.
std::vector<std::uint8_t> facing(const Drawable& drawn, const Camera& camera) {
  constexpr float kEdgeOn = 1e-5f;
  std::vector<std::uint8_t> result(drawn.triangles.size());
  parallel_for_each(result.size(), [&](std::size_t t) {
    const auto& c = drawn.triangles[t];
    const Vec3f& a = drawn.vertices[c[0]];
    const Vec3f cross = (drawn.vertices[c[1]] - a).cross(drawn.vertices[c[2]] - a);
    result[t] = cross.dot(camera.forward) < -kEdgeOn * cross.norm();
  });
  return result;
}

std::vector<Edge> candidates(const Drawable& drawn, const Camera& camera) {
  const std::vector<std::uint8_t> faces_camera = facing(drawn, camera);
  constexpr std::size_t kGrain = 1 << 14;
  std::vector<std::vector<Edge>> found(drawn.triangles.size() / kGrain + 1);
  parallel_chunks(drawn.triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t other = drawn.neighbour[t][i];
        if (other != kNoTriangle && other < t) continue;
        const bool turns = other == kNoTriangle || faces_camera[t] != faces_camera[other];
        const EdgeKind kind = drawn.edges[t][i];
        if (!turns && kind == EdgeKind::none) continue;
        if (!turns && !faces_camera[t] && kind == EdgeKind::border) continue;
        const LineKind line = turns                      ? LineKind::outline
                              : kind == EdgeKind::crease ? LineKind::crease
                                                         : LineKind::border;
        const std::uint32_t from = drawn.triangles[t][i], to = drawn.triangles[t][(i + 1) % 3];
        found[begin / kGrain].push_back(
            {drawn.vertices[from], drawn.vertices[to], {from, to}, line, kind == EdgeKind::crease});
      }
  });
  std::vector<Edge> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// The pieces of one edge with the rays that test their visibility.
struct Pieces {
  int count = 0;
  std::vector<Ray> rays, beside;
  std::vector<std::uint8_t> hidden, covered;
  std::vector<LineKind> kinds;
  std::vector<Hit> drops;
};

// The outlook from just beside the line, on both sides, through each piece.
void look_beside(const Tracer& tracer, const Camera& camera, const Vec3f& across, bool sharp,
                 Pieces& pieces) {
  pieces.beside.clear();
  for (const Ray& ray : pieces.rays)
    for (const float side : {-1.0f, 1.0f}) {
      const Vec3f at = ray.origin + side * across;
      pieces.beside.push_back({at - camera.depth(at) * camera.forward, camera.forward, 0, 1e30f});
    }
  pieces.drops.resize(pieces.beside.size());
  tracer.intersect(pieces.beside, pieces.drops);
  for (std::size_t k = 0; k < pieces.rays.size(); ++k) {
    const float own = camera.depth(pieces.rays[k].origin);
    const float farther = std::max(pieces.drops[2 * k].t, pieces.drops[2 * k + 1].t);
    if (farther < own + kDrop) {
      pieces.kinds[k] = LineKind::crease;
      if (!sharp) pieces.hidden[k] = 1;
    } else if (farther < Hit{}.t) {
      pieces.kinds[k] = LineKind::step;
    }
  }
}

// Pieces of a shape at rest that have not moved on the picture are those of the shape as it is now.
void hide_unmoved(const Edge& edge, const Drawable& moved, const Camera& camera, Pieces& pieces) {
  constexpr float kMoved = 1.5f;  // pixels
  const Vec3f from = moved.vertices[edge.vertices[0]] - edge.from,
              to = moved.vertices[edge.vertices[1]] - edge.to;
  for (int k = 0; k < pieces.count; ++k) {
    const float s = (static_cast<float>(k) + 0.5f) / static_cast<float>(pieces.count);
    const Vec3f shift = from + s * (to - from);
    const Eigen::Vector2f seen(camera.right.dot(shift), camera.up.dot(shift));
    if (camera.pixels * seen.norm() < kMoved) pieces.hidden[static_cast<std::size_t>(k)] = 1;
  }
}

void judge(const Edge& edge, const Tracer& tracer, const Moved* moved, const Camera& camera, Pieces& pieces) {
  const Eigen::Vector2f screen = camera.project(edge.to) - camera.project(edge.from);
  pieces.count = std::clamp(static_cast<int>(std::ceil(screen.norm() / kPiece)), 1, kMostPieces);
  pieces.rays.clear();
  for (int k = 0; k < pieces.count; ++k) {
    const float s = (static_cast<float>(k) + 0.5f) / static_cast<float>(pieces.count);
    pieces.rays.push_back(
        {edge.from + s * (edge.to - edge.from) - kLineLift * camera.forward, -camera.forward, 0, 1e30f});
  }
  pieces.hidden.resize(pieces.rays.size());
  tracer.occluded(pieces.rays, pieces.hidden);
  pieces.covered.assign(pieces.rays.size(), 0);
  pieces.kinds.assign(pieces.rays.size(), edge.kind);
  if (moved != nullptr) {
    moved->tracer.occluded(pieces.rays, pieces.covered);
    hide_unmoved(edge, moved->drawn, camera, pieces);
  }
  if (edge.kind != LineKind::outline) return;
  const float length = screen.norm();
  const Eigen::Vector2f normal =
      length > 0 ? Eigen::Vector2f(-screen.y(), screen.x()) / length : Eigen::Vector2f(1, 0);
  constexpr float kBeside = 1.0f;  // pixel
  look_beside(tracer, camera, kBeside / camera.pixels * (normal.x() * camera.right - normal.y() * camera.up),
              edge.sharp, pieces);
}

void add_runs(const Edge& edge, const Camera& camera, const Pieces& pieces, std::vector<ScreenLine>& lines) {
  const Eigen::Vector2f from = camera.project(edge.from), to = camera.project(edge.to);
  const auto at = [&](int k) {
    return Eigen::Vector2f(from + (to - from) * (static_cast<float>(k) / static_cast<float>(pieces.count)));
  };
  const auto index = [](int k) { return static_cast<std::size_t>(k); };
  for (int k = 0; k < pieces.count;) {
    int stop = k + 1;
    if (pieces.hidden[index(k)] == 0) {
      while (stop < pieces.count && pieces.hidden[index(stop)] == 0 &&
             pieces.kinds[index(stop)] == pieces.kinds[index(k)] &&
             pieces.covered[index(stop)] == pieces.covered[index(k)])
        ++stop;
      lines.push_back({at(k), at(stop), pieces.kinds[index(k)], pieces.covered[index(k)] != 0});
    }
    k = stop;
  }
}

}  // namespace

std::vector<ScreenLine> visible_lines(const Drawable& drawn, const Tracer& tracer, const Camera& camera,
                                      const Moved* moved) {
  const std::vector<Edge> edges = candidates(drawn, camera);
  constexpr std::size_t kGrain = 256;
  std::vector<std::vector<ScreenLine>> found(edges.size() / kGrain + 1);
  ShareCounter done(edges.size());
  parallel_chunks(edges.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    Pieces pieces;
    for (std::size_t e = begin; e < end; ++e) {
      judge(edges[e], tracer, moved, camera, pieces);
      add_runs(edges[e], camera, pieces, found[begin / kGrain]);
    }
    done.add(end - begin);
  });
  std::vector<ScreenLine> lines;
  for (const auto& part : found) lines.insert(lines.end(), part.begin(), part.end());
  return lines;
}

void draw_lines(Image& image, const std::vector<ScreenLine>& lines, const LineStyle& style) {
  // Where creases crowd (a scan, a knurl) they would paint the part black: they fade.
  double length = 0;
  for (const ScreenLine& line : lines)
    if (line.kind != LineKind::border) length += static_cast<double>((line.to - line.from).norm());
  const double most = 0.04 * image.width * image.height;
  const float fade = length > most ? static_cast<float>(most / length) : 1.0f;
  LineLayer inner(image.width, image.height), outlines(image.width, image.height);
  for (const ScreenLine& line : lines) {
    const float strength = line.behind ? style.strength_behind : style.strength;
    switch (line.kind) {
      case LineKind::outline:
        outlines.add(line.from, line.to, 2.1f * style.scale, fade * strength);
        break;
      case LineKind::step:
        inner.add(line.from, line.to, 1.9f * style.scale, fade * strength);
        break;
      case LineKind::crease:
        inner.add(line.from, line.to, 1.5f * style.scale, 0.85f * fade * strength);
        break;
      case LineKind::border:
        inner.add(line.from, line.to, 1.0f * style.scale, 0.36f * strength);
        break;
    }
  }
  inner.lay_on(image, style.ink, style.ink_on_dark);
  outlines.lay_on(image, style.ink, style.ink);
}

}  // namespace flexel::picture
