// A header of numbers, the arrays as they are in memory, and at the end a hash of all before it, so that
// damage shows as such. Two more hashes say what was bound: the lattice (rest shape, cells, what is broken)
// and the surface. Adjacency is found again: it is most of the size and little of the time.
#include "mapping/binding_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "mapping/methods/apply.h"

namespace flexel::mapping {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they are in memory");

struct Header {
  char magic[16] = "flexel binding";
  std::uint32_t version = 1;
  std::uint32_t method = 0;
  std::uint64_t lattice = 0, surface = 0;  // hashes
  std::uint64_t frames = 0, vertices = 0;
  double rest_residual = 0, distance_outside = 0;
};
static_assert(sizeof(Header) == 72);

// Frame as it is written: its own padding has no meaning.
struct PackedFrame {
  std::array<std::uint32_t, 4> elements{};
  std::uint32_t kind = 0, rings = 0;
};

template <class Value>
std::uint64_t hash_of(const std::vector<Value>& values) {
  return content_hash(std::as_bytes(std::span(values)));
}

std::uint64_t hash_of_all(const std::vector<std::uint64_t>& hashes) {
  return content_hash(std::as_bytes(std::span(hashes)));
}

std::uint64_t lattice_hash(const Body& body) {
  std::vector<std::uint64_t> all = {hash_of(body.rest), hash_of(body.lattice_index),
                                    hash_of(body.connections), hash_of(body.cell_elements),
                                    hash_of(body.broken)};
  for (const Part& part : body.parts) {
    all.insert(all.end(), {part.element_begin, part.element_end, part.cell_begin, part.cell_end,
                           static_cast<std::uint64_t>(part.placement)});
    for (const Vec3& v : {part.lattice.origin, part.lattice.spacing, Vec3(part.lattice.axes.col(0)),
                          Vec3(part.lattice.axes.col(1))})
      for (const double x : v) all.push_back(std::bit_cast<std::uint64_t>(x));
  }
  return hash_of_all(all);
}

std::uint64_t surface_hash(const Body& body) {
  std::vector<std::uint64_t> all = {
      hash_of(body.surface.vertices),         hash_of(body.surface.polygon_offsets),
      hash_of(body.surface.polygon_vertices), hash_of(body.surface.polygon_face),
      hash_of(body.surface_cell_offsets),     hash_of(body.surface_cells)};
  for (const SurfaceFace& face : body.surface.faces) all.push_back(face.part);
  return hash_of_all(all);
}

template <class Value>
void append(Bytes& bytes, const std::vector<Value>& values) {
  const std::size_t at = bytes.size();
  bytes.resize(at + values.size() * sizeof(Value));
  if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), values.size() * sizeof(Value));
}

// Takes arrays from the front of what is left.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> left) : left_(left) {}
  template <class Value>
  [[nodiscard]] std::vector<Value> take(std::size_t count) {
    std::vector<Value> values(count);
    if (count > 0) std::memcpy(static_cast<void*>(values.data()), left_.data(), count * sizeof(Value));
    left_ = left_.subspan(count * sizeof(Value));
    return values;
  }
  // The next `count` bytes.
  [[nodiscard]] std::span<const std::byte> take_bytes(std::size_t count) {
    const std::span<const std::byte> taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

 private:
  std::span<const std::byte> left_;
};

constexpr const char* kDamaged = "is damaged: save the binding again";

// The method of that number in the file; nullptr: none.
MapMethod saved_method(std::uint32_t number) {
  for (const MapMethod method : map_methods())
    if (method->file_number >= 0 && static_cast<std::uint32_t>(method->file_number) == number) return method;
  return nullptr;
}

// True when the file is as long as its header says, without overflow.
bool is_complete(const Header& header, MapMethod method, std::size_t size) {
  const std::size_t frame = sizeof(PackedFrame) + method->bytes_a_frame;
  const std::size_t vertex = sizeof(std::uint32_t) + sizeof(std::uint8_t) + method->bytes_a_vertex;
  if (header.frames > size / frame || header.vertices > size / vertex) return false;
  return size == sizeof(Header) + header.frames * frame + header.vertices * vertex + sizeof(std::uint64_t);
}

// The hash keeps what was damaged out; this, what was made by hand.
bool is_in_range(const Binding& binding, const Body& body) {
  for (const Frame& frame : binding.frames)
    for (const std::uint32_t element : frame.elements)
      if (element >= body.element_count() || frame.kind > FrameKind::rigid) return false;
  return std::all_of(binding.frame.begin(), binding.frame.end(),
                     [&](std::uint32_t frame) { return frame < binding.frames.size(); });
}

// At rest nothing moves: whatever is wrong with a coordinate or a base shows.
bool gives_rest(const Binding& binding, const Body& body) {
  constexpr double kRounding = 1e-6;  // of the part's diagonal; bindings miss it by 1e-13 or so
  const double most = kRounding * bounding_box(body.surface.vertices).diagonal();
  const std::vector<Vec3> displacement = apply(binding, body, body.rest);
  return std::all_of(displacement.begin(), displacement.end(),
                     [&](const Vec3& u) { return u.norm() <= most; });
}

Header check_header(const Bytes& bytes, const std::string& path) {
  Header header;
  const Header expected;
  if (bytes.size() < sizeof header || std::memcmp(bytes.data(), expected.magic, sizeof expected.magic) != 0)
    throw InputError(path, "is no saved binding: take what --save-binding wrote");
  std::memcpy(static_cast<void*>(&header), bytes.data(), sizeof header);
  if (header.version != expected.version)
    throw InputError(path,
                     fmt::format("is a binding of version {}, this program reads version {}: save it again",
                                 header.version, expected.version));
  const MapMethod method = saved_method(header.method);
  if (method == nullptr || !is_complete(header, method, bytes.size())) throw InputError(path, kDamaged);
  std::uint64_t hash = 0;
  std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
  if (hash != content_hash(std::span<const std::byte>(bytes).first(bytes.size() - sizeof hash)))
    throw InputError(path, kDamaged);
  return header;
}

}  // namespace

void write_binding(const Binding& binding, const Body& body, const std::string& path) {
  if (binding.method->file_number < 0)
    throw InputError(fmt::format("--save-binding: \"{}\" is not kept in a file: take --method {}",
                                 name_of(binding.method), saved_method_names()));
  Header header;
  header.method = static_cast<std::uint32_t>(binding.method->file_number);
  header.lattice = lattice_hash(body);
  header.surface = surface_hash(body);
  header.frames = binding.frames.size();
  header.vertices = binding.frame.size();
  header.rest_residual = binding.rest_residual;
  header.distance_outside = binding.distance_outside;
  std::vector<PackedFrame> frames;
  frames.reserve(binding.frames.size());
  for (const Frame& frame : binding.frames)
    frames.push_back({frame.elements, static_cast<std::uint32_t>(frame.kind), frame.rings});
  Bytes bytes(sizeof header);
  std::memcpy(bytes.data(), &header, sizeof header);
  append(bytes, frames);
  binding.method->save(*binding.kept, bytes);
  append(bytes, binding.frame);
  append(bytes, binding.referenced);
  append(bytes, std::vector<std::uint64_t>{content_hash(bytes)});
  OutputFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

Binding read_binding(const std::string& path, const Body& body) {
  const Bytes bytes = read_all(path);
  const Header header = check_header(bytes, path);
  if (header.lattice != lattice_hash(body))
    throw InputError(path, "was made for another lattice than the body's: save it again from this one");
  if (header.surface != surface_hash(body) || header.vertices != body.surface.vertices.size())
    throw InputError(path, "was made for another surface than is mapped here: save it again with this one");
  Reader reader(std::span<const std::byte>(bytes).subspan(sizeof header));
  Binding binding;
  binding.method = saved_method(header.method);
  for (const PackedFrame& frame : reader.take<PackedFrame>(header.frames))
    binding.frames.push_back(
        {frame.elements, static_cast<FrameKind>(frame.kind), static_cast<std::uint8_t>(frame.rings)});
  binding.kept = binding.method->load(reader.take_bytes(header.frames * binding.method->bytes_a_frame +
                                                        header.vertices * binding.method->bytes_a_vertex),
                                      header.frames, header.vertices);
  binding.frame = reader.take<std::uint32_t>(header.vertices);
  binding.referenced = reader.take<std::uint8_t>(header.vertices);
  if (!is_in_range(binding, body)) throw InputError(path, kDamaged);
  binding.rest_residual = header.rest_residual;
  binding.distance_outside = header.distance_outside;
  binding.connections = element_adjacency(body);
  if (!gives_rest(binding, body)) throw InputError(path, kDamaged);
  return binding;
}

}  // namespace flexel::mapping
