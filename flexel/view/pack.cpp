// Neighbours in a file are near each other, so differences are small and their high bytes repeat.
#include "flexel/view/pack.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/files/json.h"

namespace flexel::view {
namespace {

constexpr double kSteps = 65535;

// Byte b of number i goes to b * count + i.
void put(Bytes& planes, std::size_t count, std::size_t i, std::uint32_t value, int width) {
  for (int b = 0; b < width; ++b)
    planes[static_cast<std::size_t>(b) * count + i] = static_cast<std::byte>(value >> 8 * b & 255U);
}

// The upper 24 bits of single precision, rounded.
std::uint32_t short_float(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  constexpr std::uint32_t kNaN = 0x7fc000, kLargest = 0x7f7fff;
  if (std::isnan(value)) return kNaN;
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(value, -kMost, kMost)));
  const std::uint32_t sign = bits >> 31 << 23, rounded = ((bits & 0x7fffffffU) + 0x80U) >> 8;
  return sign | std::min(rounded, kLargest);
}

}  // namespace

void ArrayPack::add_points(const std::string& name, std::span<const Vec3> points) {
  Box box;
  for (const Vec3& point : points) box.add(point);
  const Vec3 lower = points.empty() ? Vec3(Vec3::Zero()) : box.min;
  const double extent = box.size().maxCoeff(), step = extent > 0 ? extent / kSteps : 1;
  const std::size_t count = 3 * points.size();
  Bytes planes(2 * count);
  std::array<std::uint32_t, 3> before{};
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const auto now = static_cast<std::uint32_t>(std::lround((points[i][axis] - lower[axis]) / step));
      put(planes, count, 3 * i + a, now - before[a], 2);
      before[a] = now;
    }
  add(name,
      fmt::format(R"("kind":"points","lower":[{},{},{}],"step":{})", lower.x(), lower.y(), lower.z(), step),
      points.size(), 6, planes);
}

void ArrayPack::add_indices(const std::string& name, std::span<const std::uint32_t> indices) {
  Bytes planes(4 * indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i)
    put(planes, indices.size(), i, indices[i] - (i > 0 ? indices[i - 1] : 0), 4);
  add(name, R"("kind":"indices")", indices.size(), 4, planes);
}

void ArrayPack::add_numbers(const std::string& name, std::span<const double> numbers) {
  Bytes planes(3 * numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) put(planes, numbers.size(), i, short_float(numbers[i]), 3);
  add(name, R"("kind":"numbers")", numbers.size(), 3, planes);
}

void ArrayPack::add_bytes(const std::string& name, std::span<const std::uint8_t> bytes) {
  add(name, R"("kind":"bytes")", bytes.size(), 1, std::as_bytes(bytes));
}

void ArrayPack::add(const std::string& name, const std::string& description, std::size_t count, int width,
                    std::span<const std::byte> planes) {
  const Bytes packed = compress(planes, level_);
  arrays_ +=
      fmt::format(R"({}{}:{{{},"count":{},"width":{},"offset":{},"bytes":{}}})", arrays_.empty() ? "" : ",",
                  json_text(name), description, count, width, data_.size(), packed.size());
  data_.insert(data_.end(), packed.begin(), packed.end());
}

Bytes ArrayPack::finish(const std::string& about) const {
  const std::string text = fmt::format(R"({{"about":{},"arrays":{{{}}}}})", about, arrays_);
  Bytes all(8 + text.size());
  const auto length = static_cast<std::uint32_t>(text.size());
  std::memcpy(all.data(), "FLXV", 4);
  std::memcpy(all.data() + 4, &length, 4);
  std::memcpy(all.data() + 8, text.data(), text.size());
  all.insert(all.end(), data_.begin(), data_.end());
  return all;
}

}  // namespace flexel::view
