// Views by name, and an orthographic camera from a view.
#include "flexel/picture/render/camera.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/nearest_word.h"

namespace flexel::picture {
namespace {

struct NamedView {
  const char* name;
  View view;
};
constexpr std::array<NamedView, 7> kViews{{{"iso", {}},
                                           {"front", {0, 0}},
                                           {"back", {180, 0}},
                                           {"left", {-90, 0}},
                                           {"right", {90, 0}},
                                           {"top", {0, 90}},
                                           {"bottom", {0, -90}}}};

std::optional<double> number(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

std::optional<View> parse_view(const std::string& text) {
  if (text == "auto") return std::nullopt;
  std::vector<std::string> names{"auto"};
  for (const NamedView& named : kViews) {
    if (text == named.name) return named.view;
    names.emplace_back(named.name);
  }
  const std::size_t comma = text.find(',');
  if (comma != std::string::npos) {
    const auto azimuth = number(std::string_view(text).substr(0, comma));
    const auto elevation = number(std::string_view(text).substr(comma + 1));
    if (azimuth && elevation && std::abs(*elevation) <= 90)
      return View{std::remainder(*azimuth, 360), *elevation};
    throw InputError(fmt::format(
        "--view \"{}\": AZIMUTH,ELEVATION are two numbers of degrees, the second from -90 to 90: 45,35",
        text));
  }
  throw InputError(fmt::format("unknown view \"{}\": {} or AZIMUTH,ELEVATION in degrees{}", text,
                               fmt::join(names, ", "), did_you_mean(text, names)));
}

Camera camera_towards(const View& view) {
  const double azimuth = view.azimuth * std::numbers::pi / 180,
               elevation = view.elevation * std::numbers::pi / 180;
  const Vec3 horizontal(std::sin(azimuth), -std::cos(azimuth), 0);
  const Vec3 right(std::cos(azimuth), std::sin(azimuth), 0);
  const Vec3 up = std::cos(elevation) * Vec3::UnitZ() - std::sin(elevation) * horizontal;
  // From axes with z up to the file's.
  const auto turned = [&](const Vec3& v) {
    if (view.up == Up::y) return Vec3(v.x(), v.z(), -v.y());
    return view.up == Up::x ? Vec3(v.z(), v.x(), v.y()) : v;
  };
  Camera camera;
  camera.right = turned(right).cast<float>();
  camera.up = turned(up).cast<float>();
  camera.forward = turned(up.cross(right)).cast<float>();
  return camera;
}

Eigen::Vector4f extent(const Camera& camera, std::span<const Vec3f> points) {
  Eigen::Vector4f box(1e30f, 1e30f, -1e30f, -1e30f);
  for (const Vec3f& p : points) {
    const float a = camera.right.dot(p), b = camera.up.dot(p);
    box = Eigen::Vector4f(std::min(box[0], a), std::min(box[1], b), std::max(box[2], a), std::max(box[3], b));
  }
  return box;
}

}  // namespace flexel::picture
