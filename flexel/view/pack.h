// Arrays as the page takes them: as exact as eyes need, and small. page/unpack.js reads them.
//
// A pack is "FLXV", the length of a JSON text (uint32, little-endian), the text {"about": ..., "arrays": {NAME: {kind, count,
// offset, bytes, ...}}}, and the arrays, each compressed (zlib) once its bytes are sorted by their weight: first the lowest of all
// numbers, then the next.
#pragma once
#include <span>
#include <string>

#include "base/files/files.h"
#include "base/math/vec.h"

namespace flexel::view {

constexpr int kUsualLevel = 6, kQuickLevel = 1;  // of zlib: the second in a third of the time, and larger

class ArrayPack {
 public:
  explicit ArrayPack(int level = kUsualLevel) : level_(level) {}

  // (n x 3) Each coordinate is rounded to a step of a 65,535th of the greatest extent of the box around them, so it is wrong by
  // half of that at most. Finite. Kind "points": 16 bits, the difference from the one before, modulo 2^16.
  void add_points(const std::string& name, std::span<const Vec3> points);
  // Kind "indices": 32 bits, the difference from the one before, modulo 2^32.
  void add_indices(const std::string& name, std::span<const std::uint32_t> indices);
  // Kind "numbers": single precision with a significand of 16 bits, so wrong by 2^-16 of themselves at most; NaN stays NaN, and
  // what is beyond single precision becomes its largest.
  void add_numbers(const std::string& name, std::span<const double> numbers);
  // Kind "bytes".
  void add_bytes(const std::string& name, std::span<const std::uint8_t> bytes);

  // All of it. `about`: JSON.
  [[nodiscard]] Bytes finish(const std::string& about) const;
  [[nodiscard]] std::size_t size() const { return data_.size(); }  // bytes, without the text

 private:
  void add(const std::string& name, const std::string& description, std::size_t count, int width,
           std::span<const std::byte> planes);
  int level_;
  std::string arrays_;  // members of a JSON object
  Bytes data_;
};

}  // namespace flexel::view
