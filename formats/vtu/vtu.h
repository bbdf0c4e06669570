// VTK XML unstructured grids with appended raw data: named numeric arrays in five sections. What the arrays
// mean is body_file's business. Layout after VTK's "VTK XML file formats" (Kitware); version 1.0, 64-bit
// headers, little endian.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/math/vec.h"

namespace flexel::vtu {

enum class Section { field, points, point_data, cells, cell_data };

template <class Scalar>
constexpr const char* type_name() {
  if constexpr (std::is_same_v<Scalar, double>) return "Float64";
  if constexpr (std::is_same_v<Scalar, std::int32_t>) return "Int32";
  if constexpr (std::is_same_v<Scalar, std::int64_t>) return "Int64";
  if constexpr (std::is_same_v<Scalar, std::uint8_t>) return "UInt8";
  if constexpr (std::is_same_v<Scalar, std::uint16_t>) return "UInt16";
  if constexpr (std::is_same_v<Scalar, std::uint32_t>) return "UInt32";
}

// How many numbers of which type one entry of a vector is in memory.
template <class Entry>
struct Layout {
  using Scalar = Entry;
  static constexpr std::size_t components = 1;
};
template <class S, std::size_t n>
struct Layout<std::array<S, n>> {
  using Scalar = S;
  static constexpr std::size_t components = n;
};
template <>
struct Layout<Vec3> {
  using Scalar = double;
  static constexpr std::size_t components = 3;
};
template <>
struct Layout<std::byte> {
  using Scalar = std::uint8_t;
  static constexpr std::size_t components = 1;
};

// An array to write: (tuples x components). Either lies in memory as it is written, or is made a few tuples
// at a time.
struct Array {
  Section section = Section::field;
  std::string name;
  std::string type;
  std::size_t scalar_size = 1;  // bytes
  std::size_t components = 1;
  std::size_t tuples = 0;
  const void* memory = nullptr;
  std::function<void(std::size_t begin, std::size_t end, void* out)>
      make;  // where memory is null: tuples [begin, end)
  [[nodiscard]] std::size_t tuple_size() const { return scalar_size * components; }
  [[nodiscard]] std::size_t size() const { return tuple_size() * tuples; }
};

// `values` must outlive the array.
template <class Entry>
[[nodiscard]] Array array_of(Section section, std::string name, const std::vector<Entry>& values) {
  using L = Layout<Entry>;
  using Scalar = typename L::Scalar;
  static_assert(sizeof(Entry) == sizeof(Scalar) * L::components);
  return {section,       std::move(name), type_name<Scalar>(), sizeof(Scalar),
          L::components, values.size(),   values.data(),       {}};
}

// entry(i) for i in [0, tuples).
template <class Entry, class Make>
[[nodiscard]] Array made_array(Section section, std::string name, std::size_t tuples, const Make& entry) {
  using L = Layout<Entry>;
  using Scalar = typename L::Scalar;
  const auto make = [entry](std::size_t begin, std::size_t end, void* out) {
    Entry* next = static_cast<Entry*>(out);
    for (std::size_t i = begin; i < end; ++i) *next++ = entry(i);
  };
  return {section, std::move(name), type_name<Scalar>(), sizeof(Scalar), L::components, tuples, nullptr,
          make};
}

// Point data of this name are VTK's global ids: the same in every file for the same point.
constexpr const char* kGlobalPointIds = "GlobalPointIds";

// Appends the whole file to `output`, without committing it.
void write(OutputFile& output, std::size_t points, std::size_t cells, const std::vector<Array>& arrays,
           bool compress);

struct HeadArray;  // formats/vtu/vtu_head.h

// A file that was read, its arrays still packed. Every offset and size is checked when it is opened, so that
// none is trusted later. Throws InputError: truncated, not a .vtu with appended raw data, sizes that do not
// agree (naming the array).
class File {
 public:
  File(Bytes bytes, std::string where);
  [[nodiscard]] std::size_t points() const { return points_; }
  [[nodiscard]] std::size_t cells() const { return cells_; }
  [[nodiscard]] bool has(Section section, const std::string& name) const {
    return arrays_.count({section, name}) != 0;
  }
  [[nodiscard]] std::vector<std::string> names(Section section) const;
  [[nodiscard]] const std::string& type(Section section, const std::string& name) const;
  [[nodiscard]] std::size_t tuples(Section section, const std::string& name) const;
  [[nodiscard]] std::size_t components(Section section, const std::string& name) const;
  [[noreturn]] void fail(const std::string& what) const;

  // The array; InputError where it is missing or its type or number of components is another.
  template <class Entry>
  [[nodiscard]] std::vector<Entry> read(Section section, const std::string& name) const {
    using L = Layout<Entry>;
    using Scalar = typename L::Scalar;
    static_assert(sizeof(Entry) == sizeof(Scalar) * L::components);
    std::vector<Entry> values(expect(section, name, type_name<Scalar>(), L::components));
    unpack(section, name, values.data());
    return values;
  }
  // The array as (tuples x components) numbers, whatever its number of components.
  [[nodiscard]] std::vector<double> read_flat(Section section, const std::string& name) const;

 private:
  struct Stored {
    std::string type;
    std::size_t components = 1, tuples = 0;
    std::size_t size = 0;                          // bytes, unpacked
    std::size_t begin = 0;                         // of the (first block of the) data in bytes_
    std::size_t block_size = 0;                    // compressed: bytes of a block, unpacked
    std::vector<std::uint64_t> packed_block_size;  // compressed: bytes of each block, packed
  };
  [[nodiscard]] std::size_t find_data();
  [[nodiscard]] Stored locate(const HeadArray& array) const;
  void locate_raw(Stored& stored, const std::string& name, std::size_t begin) const;
  void locate_blocks(Stored& stored, const std::string& name, std::size_t begin) const;
  [[nodiscard]] std::uint64_t header(std::size_t at) const;
  [[nodiscard]] const Stored& stored(Section section, const std::string& name) const;
  [[nodiscard]] std::size_t expect(Section section, const std::string& name, const char* type,
                                   std::size_t components) const;
  void unpack(Section section, const std::string& name, void* out) const;
  [[noreturn]] void fail_truncated() const;

  Bytes bytes_;
  std::string where_;
  std::size_t data_begin_ = 0, data_end_ = 0;  // of the appended data in bytes_
  bool compressed_ = false;
  std::size_t points_ = 0, cells_ = 0;
  std::map<std::pair<Section, std::string>, Stored> arrays_;
};

// Cuts data into blocks and compresses each on its own, in parallel; the blocks' sizes are returned beside
// the packed bytes.
struct PackedBlocks {
  Bytes bytes;
  std::vector<std::uint64_t> sizes;
};
constexpr std::size_t kBlockSize = std::size_t{1} << 18;  // bytes, unpacked
[[nodiscard]] PackedBlocks pack_blocks(std::span<const std::byte> data, int level);
// Throws InputError where a block is damaged. `out` has room for `size` bytes.
void unpack_blocks(std::span<const std::byte> packed, std::span<const std::uint64_t> sizes,
                   std::size_t block_size, std::size_t size, std::byte* out);

}  // namespace flexel::vtu
