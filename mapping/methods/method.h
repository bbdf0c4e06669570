// A mapping method: one file, which defines one row (two where they differ in a flag), and a line in the list of
// mapping/methods/method.cpp. What it keeps of the surface at rest is its own class.
#pragma once
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "base/files/files.h"
#include "mapping/anchors/vertex_anchor.h"
#include "mapping/types/options.h"

namespace flexel::mapping {

struct Binding;

// What a method keeps of the surface and the lattice at rest.
class MethodBinding {
 public:
  virtual ~MethodBinding() = default;
  // Maps the state `position` (elements x 3, m) onto the vertices: (vertices x 3) m.
  [[nodiscard]] virtual std::vector<Vec3> apply(const Binding& binding, const Body& body,
                                                const std::vector<Vec3>& position) const = 0;
};

// What a method is bound with.
struct MethodInput {
  const Body& body;
  const Adjacency& connections;              // of the elements
  const std::vector<VertexAnchor>& anchors;  // (vertices)
  std::size_t states = 1;                    // how many will be mapped
  std::vector<Mat3> rest_base;    // (frames) with `keeps_coordinates`: their bases at rest, to be taken
  std::vector<Vec3> coordinates;  // (vertices x 3) with `keeps_coordinates`: in these bases, m or edges
};

struct MappingMethod {
  std::string_view name{};         // of --method
  std::string_view help{};         // in a few words, for --help; may be empty
  bool orthonormal = false;        // bases of frames are orthonormal axes; else the edges
  bool keeps_coordinates = false;  // it carries vertices by their coordinates in the bases
  std::shared_ptr<const MethodBinding> (*bind)(MethodInput& input) = nullptr;

  // For the binding file (mapping/binding_file.h): the method's number in it, which never changes; below 0:
  // what it keeps is too much to be worth a file, and the rest is empty.
  int file_number = -1;
  std::size_t bytes_a_frame = 0, bytes_a_vertex = 0;  // of what save() appends
  void (*save)(const MethodBinding& binding, Bytes& bytes) = nullptr;
  std::shared_ptr<const MethodBinding> (*load)(std::span<const std::byte> bytes, std::size_t frames,
                                               std::size_t vertices) = nullptr;
};

// All methods.
[[nodiscard]] std::span<const MapMethod> map_methods();
// For a body with the field of model `quadratic` that field; else `blended`.
[[nodiscard]] MapMethod default_method(const Body& body);
// For help texts: "blended, smooth, affine or gram-schmidt (the paper's)".
[[nodiscard]] std::string method_help();
// The names of those that a binding file can hold: "affine or gram-schmidt".
[[nodiscard]] std::string saved_method_names();

}  // namespace flexel::mapping
