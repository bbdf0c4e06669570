// Lengths and arrays as they are in memory: both sides are one program. The side that reads believes nothing
// all the same, for the other may have been damaged by what it read.
#include "formats/cad/cad_reading.h"

#include <cstring>

#include "base/error.h"

namespace flexel {
namespace {

constexpr std::uint64_t kEndMark = 0x666c6578656c3031;

class ReadingPacker {
 public:
  void raw(void* data, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), from, from + size);
  }
  std::size_t length(std::size_t count, std::size_t) {
    std::uint64_t number = count;
    raw(&number, sizeof number);
    return count;
  }
  Bytes bytes;
};

class ReadingUnpacker {
 public:
  ReadingUnpacker(std::span<const std::byte> bytes, const std::string& where) : left_(bytes), where_(where) {}
  void raw(void* data, std::size_t size) {
    if (size > left_.size()) fail();
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_ = left_.subspan(size);
  }
  std::size_t length(std::size_t, std::size_t least_size) {
    std::uint64_t number = 0;
    raw(&number, sizeof number);
    if (number > left_.size() / least_size) fail();
    return number;
  }
  [[nodiscard]] bool empty() const { return left_.empty(); }
  [[noreturn]] void fail() const {
    throw InputError(where_, "is damaged: OpenCASCADE makes nothing sound of it");
  }

 private:
  std::span<const std::byte> left_;
  const std::string& where_;
};

template <class Archive>
void visit(Archive& archive, std::uint32_t& value) {
  archive.raw(&value, sizeof value);
}

template <class Archive>
void visit(Archive& archive, std::string& text) {
  text.resize(archive.length(text.size(), 1));
  archive.raw(text.data(), text.size());
}

template <class Archive>
void visit(Archive& archive, SurfacePart& part) {
  visit(archive, part.name);
}

template <class Archive>
void visit(Archive& archive, SurfaceFace& face) {
  visit(archive, face.name);
  visit(archive, face.part);
}

template <class Archive, class Number>
void visit_numbers(Archive& archive, std::vector<Number>& values) {
  values.resize(archive.length(values.size(), sizeof(Number)));
  archive.raw(static_cast<void*>(values.data()), values.size() * sizeof(Number));
}

template <class Archive, class Value>
void visit_each(Archive& archive, std::vector<Value>& values) {
  values.resize(archive.length(values.size(), sizeof(std::uint64_t)));  // the length of a text at least
  for (Value& value : values) visit(archive, value);
}

template <class Archive>
void visit(Archive& archive, CadReading& reading) {
  std::uint32_t refused = reading.refused;
  visit(archive, refused);
  reading.refused = refused != 0;
  visit_each(archive, reading.warnings);
  visit(archive, reading.where);
  visit(archive, reading.why);
  Surface& surface = reading.mesh.surface;
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  visit_numbers(archive, surface.vertices);
  visit_numbers(archive, surface.polygon_offsets);
  visit_numbers(archive, surface.polygon_vertices);
  visit_numbers(archive, surface.polygon_face);
  visit_each(archive, surface.faces);
  visit_each(archive, surface.parts);
  visit_numbers(archive, reading.mesh.face_colors);
}

}  // namespace

Bytes pack(const CadReading& reading) {
  ReadingPacker packer;
  visit(packer, const_cast<CadReading&>(reading));
  std::uint64_t mark = kEndMark;
  packer.raw(&mark, sizeof mark);
  return std::move(packer.bytes);
}

CadReading unpack_reading(std::span<const std::byte> bytes, const std::string& where) {
  ReadingUnpacker unpacker(bytes, where);
  CadReading reading;
  visit(unpacker, reading);
  std::uint64_t mark = 0;
  unpacker.raw(&mark, sizeof mark);
  if (mark != kEndMark || !unpacker.empty()) unpacker.fail();
  const std::vector<double>& colors = reading.mesh.face_colors;
  if (!colors.empty() && colors.size() != 3 * reading.mesh.surface.faces.size()) unpacker.fail();
  return reading;
}

}  // namespace flexel
