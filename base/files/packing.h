// Values as bytes and back: lengths and arrays as they are in memory, for one program on one machine. One visit()
// of a type serves both directions. What is read is not believed: lengths are checked against what is there.
#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/files/files.h"
#include "base/math/vec.h"

namespace flexel {

static_assert(std::endian::native == std::endian::little);

class Packer {
 public:
  void raw(void* data, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), from, from + size);
  }
  [[nodiscard]] std::size_t length(std::size_t count, std::size_t) {
    std::uint64_t number = count;
    raw(&number, sizeof number);
    return count;
  }
  Bytes bytes;
};

// Throws InputError(where, damage) where the bytes do not fit together.
class Unpacker {
 public:
  Unpacker(std::span<const std::byte> bytes, std::string where, std::string damage)
      : left_(bytes), where_(std::move(where)), damage_(std::move(damage)) {}
  void raw(void* data, std::size_t size) {
    if (size > left_.size()) fail();
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_ = left_.subspan(size);
  }
  [[nodiscard]] std::size_t length(std::size_t, std::size_t least_size) {
    std::uint64_t number = 0;
    raw(&number, sizeof number);
    if (number > left_.size() / least_size) fail();
    return number;
  }
  void finish() const {
    if (!left_.empty()) fail();
  }
  [[noreturn]] void fail() const { throw InputError(where_, damage_); }

 private:
  std::span<const std::byte> left_;
  std::string where_, damage_;
};

template <class Archive, class Value>
requires std::is_trivially_copyable_v<Value>
void visit(Archive& archive, Value& value) {
  archive.raw(&value, sizeof value);
}

// Any byte but 0 is true: what is read may hold others than a bool does.
template <class Archive>
void visit(Archive& archive, bool& value) {
  std::uint8_t byte = value ? 1 : 0;
  archive.raw(&byte, 1);
  value = byte != 0;
}

template <class Archive>
void visit(Archive& archive, Vec3& value) {
  archive.raw(value.data(), sizeof(Vec3));
}

template <class Archive>
void visit(Archive& archive, std::string& text) {
  text.resize(archive.length(text.size(), 1));
  archive.raw(text.data(), text.size());
}

template <class Archive>
void visit(Archive& archive, std::optional<double>& value) {
  double number = value.value_or(0);
  std::uint8_t there = value.has_value();
  archive.raw(&there, 1);
  archive.raw(&number, sizeof number);
  value = there ? std::optional(number) : std::nullopt;
}

template <class Archive, class Value>
void visit(Archive& archive, std::vector<Value>& values) {
  // Of a text or a row there is at least its length.
  constexpr bool kPlain = std::is_trivially_copyable_v<Value> || std::is_same_v<Value, Vec3>;
  values.resize(archive.length(values.size(), kPlain ? sizeof(Value) : sizeof(std::uint64_t)));
  if constexpr (kPlain)
    archive.raw(static_cast<void*>(values.data()), values.size() * sizeof(Value));
  else
    for (Value& value : values) visit(archive, value);
}

// The members of a type, in this order.
template <class Archive, class... Values>
void visit_all(Archive& archive, Values&... values) {
  (visit(archive, values), ...);
}

}  // namespace flexel
