// Rays on a coarse grid tell which face is seen where. The place of a text is the point of its face that is
// farthest from all else, by the two-pass chessboard distance transform (Rosenfeld and Pfaltz 1966): a text
// is about twice as wide as it is tall, so the grid's steps are too. Large faces come first; a text that has
// no room is tried smaller, and left out below 10 pixels.
#include "flexel/picture/face_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "flexel/picture/annotate.h"
#include "flexel/picture/text.h"

namespace flexel {
namespace {

constexpr int kStepX = 4, kStepY = 2;       // pixels
constexpr float kLeastSize = 10;            // pixels to the em
constexpr float kCapHeight = 0.72f;         // of the em, of digits
constexpr std::uint32_t kPlate = 0xffffff;  // behind the text
constexpr float kPlateShare = 0.78f;

struct FaceMap {
  int columns = 0, rows = 0;
  std::vector<std::uint32_t> face;  // (rows x columns); kNoHit: background
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
};

FaceMap look(const Viewport& viewport, const Camera& camera, const Panel& panel) {
  FaceMap map;
  map.columns = viewport.width / kStepX;
  map.rows = viewport.height / kStepY;
  std::vector<Ray> rays;
  for (int row = 0; row < map.rows; ++row)
    for (int column = 0; column < map.columns; ++column)
      rays.push_back(camera.ray(static_cast<float>(viewport.x + column * kStepX) + 0.5f,
                                static_cast<float>(viewport.y + row * kStepY) + 0.5f));
  std::vector<Hit> hits(rays.size());
  panel.tracer->intersect(rays, hits);
  for (const Hit& hit : hits)
    map.face.push_back(hit.primitive == kNoHit ? kNoHit : panel.drawn.face[hit.primitive]);
  return map;
}

// Steps of the grid to the nearest point that is not of the same face.
std::vector<int> distances(const FaceMap& map) {
  std::vector<int> distance(map.face.size(), 0);
  const auto pass = [&](bool forward) {
    for (int i = 0; i < map.rows * map.columns; ++i) {
      const int at = forward ? i : map.rows * map.columns - 1 - i;
      const int row = at / map.columns, column = at % map.columns;
      const int back = forward ? -1 : 1;
      const std::size_t here = map.index(column, row);
      int least = forward ? 1 << 20 : distance[here];
      for (const auto& [dx, dy] : {std::pair{back, 0}, {-1, back}, {0, back}, {1, back}}) {
        const int x = column + dx, y = row + dy;
        const bool inside = x >= 0 && y >= 0 && x < map.columns && y < map.rows;
        const bool same = inside && map.face[map.index(x, y)] == map.face[here];
        least = std::min(least, same ? distance[map.index(x, y)] + 1 : 1);
      }
      distance[here] = least;
    }
  };
  pass(true);
  pass(false);
  return distance;
}

struct Plate {
  float left, top, right, bottom;  // pixels
  [[nodiscard]] bool meets(const Plate& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

struct Widest {
  std::size_t points = 0;  // of the grid, seen
  int distance = 0;        // steps
  int column = 0, row = 0;
};

}  // namespace

std::vector<std::string> face_texts(const Surface& surface) {
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  std::vector<std::string> texts;
  for (std::size_t f = 0; f < numbers.size(); ++f)
    texts.push_back(surface.parts.size() == 1
                        ? fmt::format("{}", numbers[f])
                        : fmt::format("{}/{}", surface.parts[surface.faces[f].part].name, numbers[f]));
  return texts;
}

void label_faces(Image& image, const Viewport& viewport, const Camera& camera, const Panel& panel,
                 const std::vector<std::string>& texts, float size, std::vector<std::uint8_t>& shown) {
  const FaceMap map = look(viewport, camera, panel);
  const std::vector<int> distance = distances(map);
  std::vector<Widest> widest(texts.size());
  for (int row = 0; row < map.rows; ++row)
    for (int column = 0; column < map.columns; ++column) {
      const std::uint32_t face = map.face[map.index(column, row)];
      if (face == kNoHit) continue;
      Widest& place = widest[face];
      ++place.points;
      if (const int here = distance[map.index(column, row)]; here > place.distance)
        place = {place.points, here, column, row};
    }
  std::vector<std::uint32_t> order(texts.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return widest[a].points > widest[b].points; });
  std::vector<Plate> taken;
  for (const std::uint32_t face : order) {
    const Widest& place = widest[face];
    if (place.points == 0) break;
    const auto x = static_cast<float>(viewport.x + place.column * kStepX),
               y = static_cast<float>(viewport.y + place.row * kStepY);
    const auto room_x = static_cast<float>((place.distance - 1) * kStepX),
               room_y = static_cast<float>((place.distance - 1) * kStepY);
    for (float em = size; em >= kLeastSize; em *= 0.85f) {
      const float half = text_width(texts[face], em) / 2, tall = kCapHeight * em / 2;
      if (half > room_x || tall > room_y) continue;
      const float edge = 0.15f * em;
      const Plate plate{x - half - edge, y - tall - edge, x + half + edge, y + tall + edge};
      if (std::any_of(taken.begin(), taken.end(), [&](const Plate& other) { return plate.meets(other); }))
        continue;
      fill_rectangle(image, plate.left, plate.top, plate.right, plate.bottom, colour(kPlate), kPlateShare);
      draw_text(image, x, y + tall, texts[face], em, colour(kInk), Anchor::middle);
      taken.push_back(plate);
      shown[face] = 1;
      break;
    }
  }
}

}  // namespace flexel
