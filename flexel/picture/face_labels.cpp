// Rays on a coarse grid find the visible face at each grid point. A label goes to the point of its face
// farthest from everything else, by the two-pass chessboard distance transform (Rosenfeld and Pfaltz 1966);
// the grid's steps are twice as wide as tall, like a label. Large faces come first; a label that does not fit
// is made smaller, and left out below 10 pixels.
#include "flexel/picture/face_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "flexel/picture/canvas/text.h"
#include "flexel/picture/render/annotate.h"

namespace flexel::picture {
namespace {

constexpr int kStepX = 4, kStepY = 2;       // pixels
constexpr float kLeastSize = 10;            // pixels to the em
constexpr float kCapHeight = 0.72f;         // of the em, of digits
constexpr float kLeaderSize = 13;           // pixels to the em, of a text beside its face
constexpr int kTurns = 12, kReaches = 4;    // places that are tried for it
constexpr std::size_t kLeastPoints = 4;     // of the grid: less of a face is not seen
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

// Of a text with its middle at `at`.
Plate plate_at(const Eigen::Vector2f& at, const std::string& text, float em) {
  const float edge = 0.15f * em, half = text_width(text, em) / 2 + edge, tall = kCapHeight * em / 2 + edge;
  return {at.x() - half, at.y() - tall, at.x() + half, at.y() + tall};
}

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

namespace {

// For each face the place that is farthest from all others.
std::vector<Widest> widest_places(const FaceMap& map, std::size_t faces) {
  const std::vector<int> distance = distances(map);
  std::vector<Widest> widest(faces);
  for (int row = 0; row < map.rows; ++row)
    for (int column = 0; column < map.columns; ++column) {
      const std::uint32_t face = map.face[map.index(column, row)];
      if (face == kNoHit) continue;
      Widest& place = widest[face];
      ++place.points;
      if (const int here = distance[map.index(column, row)]; here > place.distance)
        place = {place.points, here, column, row};
    }
  return widest;
}

}  // namespace

void label_faces(Image& image, const Viewport& viewport, const Camera& camera, const Panel& panel,
                 const std::vector<std::string>& texts, float size, bool beside,
                 std::vector<std::uint8_t>& shown) {
  const FaceMap map = look(viewport, camera, panel);
  const std::vector<Widest> widest = widest_places(map, texts.size());
  std::vector<std::uint32_t> order(texts.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return widest[a].points > widest[b].points; });
  std::vector<Plate> taken;
  const auto free = [&](const Plate& plate) {
    return std::none_of(taken.begin(), taken.end(), [&](const Plate& other) { return plate.meets(other); });
  };
  const auto write = [&](std::uint32_t face, const Plate& plate, float em) {
    fill_rectangle(image, plate.left, plate.top, plate.right, plate.bottom, colour(kPlate), kPlateShare);
    draw_text(image, (plate.left + plate.right) / 2, (plate.top + plate.bottom) / 2 + kCapHeight * em / 2,
              texts[face], em, colour(kInk), Anchor::middle);
    taken.push_back(plate);
    shown[face] = 1;
  };
  const auto pixel = [&](const Widest& place) {
    return Eigen::Vector2f(static_cast<float>(viewport.x + place.column * kStepX),
                           static_cast<float>(viewport.y + place.row * kStepY));
  };
  for (const std::uint32_t face : order) {
    const Widest& place = widest[face];
    if (place.points == 0) break;
    const auto room = static_cast<float>(place.distance - 1);
    for (float em = size; em >= kLeastSize; em *= 0.85f) {
      const Plate plate = plate_at(pixel(place), texts[face], em);
      if (text_width(texts[face], em) / 2 > room * kStepX || kCapHeight * em / 2 > room * kStepY ||
          !free(plate))
        continue;
      write(face, plate, em);
      break;
    }
  }
  if (!beside) return;
  // Beside a dot on the face, at the end of a short line.
  for (const std::uint32_t face : order) {
    const Widest& place = widest[face];
    if (place.points < kLeastPoints) break;
    if (shown[face]) continue;
    const Eigen::Vector2f dot = pixel(place);
    for (int turn = 0; turn < kTurns * kReaches && !shown[face]; ++turn) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(turn % kTurns) / kTurns;
      const float reach = kLeaderSize * (1.5f + 0.9f * static_cast<float>(turn / kTurns));
      const Eigen::Vector2f end = dot + reach * Eigen::Vector2f(std::cos(angle), std::sin(angle));
      const Plate plate = plate_at(end, texts[face], kLeaderSize);
      if (!free(plate) || plate.left < 0 || plate.top < 0 || plate.right > static_cast<float>(image.width) ||
          plate.bottom > static_cast<float>(image.height))
        continue;
      draw_stroke(image, dot, end, 1.2f, colour(kInk));
      draw_stroke(image, dot, dot, 4.5f, colour(kInk));
      taken.push_back({dot.x() - 3, dot.y() - 3, dot.x() + 3, dot.y() + 3});
      write(face, plate, kLeaderSize);
    }
  }
}

}  // namespace flexel::picture
