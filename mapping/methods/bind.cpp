// Each distinct anchor gets a frame: a byte for each cell (and element) records which of its eight octants
// are used, and a prefix sum numbers them. Then each vertex gets its coordinates in the rest base of its
// frame, which is all that the paper's transformation (section 6.1.2) needs later.
#include "mapping/methods/bind.h"

#include <Eigen/LU>
#include <atomic>
#include <bit>
#include <cmath>

#include "base/bucket.h"
#include "mapping/anchors/blend_weights.h"
#include "mapping/anchors/frame_kernel.h"
#include "mapping/anchors/search.h"
#include "mapping/anchors/vertex_anchor.h"

namespace flexel::mapping {
namespace {

// How many bits a byte has set: the portable instruction set has nothing for it.
constexpr std::array<std::uint8_t, 256> kBitsSet = [] {
  std::array<std::uint8_t, 256> bits{};
  for (unsigned byte = 0; byte < bits.size(); ++byte)
    bits[byte] = static_cast<std::uint8_t>(std::popcount(byte));
  return bits;
}();

// Numbers the octants that are taken, owner by owner.
class OctantNumbers {
 public:
  explicit OctantNumbers(std::size_t owners) : taken_(owners, 0), first_(owners) {}
  void take(std::uint32_t owner, int octant) {
    const auto bit = static_cast<std::uint8_t>(1u << octant);
    const std::atomic_ref<std::uint8_t> taken(taken_[owner]);
    if (!(taken.load(std::memory_order_relaxed) & bit)) taken.fetch_or(bit, std::memory_order_relaxed);
  }
  // Numbers from `next`; returns what follows the last.
  std::uint32_t number(std::uint32_t next) {
    for (std::size_t owner = 0; owner < taken_.size(); ++owner) {
      first_[owner] = next;
      next += kBitsSet[taken_[owner]];
    }
    return next;
  }
  [[nodiscard]] std::uint32_t of(std::uint32_t owner, int octant) const {
    const unsigned below = taken_[owner] & ((1u << octant) - 1u);
    return first_[owner] + kBitsSet[below];
  }
  // visit(owner, octant, number) for each taken octant.
  template <class Visit>
  void for_each(const Visit& visit) const {
    parallel_for_each(taken_.size(), [&](std::size_t owner) {
      std::uint32_t number = first_[owner];
      for (unsigned left = taken_[owner]; left != 0; left &= left - 1)
        visit(static_cast<std::uint32_t>(owner), std::countr_zero(left), number++);
    });
  }

 private:
  std::vector<std::uint8_t> taken_;
  std::vector<std::uint32_t> first_;
};

void make_frames(const Body& body, const std::vector<VertexAnchor>& anchors, Binding& binding) {
  OctantNumbers in_cells(body.cell_count()), at_elements(body.element_count());
  parallel_for_each(anchors.size(), [&](std::size_t v) {
    (anchors[v].in_cell ? in_cells : at_elements).take(anchors[v].owner, anchors[v].octant);
  });
  resize_touched(binding.frames, at_elements.number(in_cells.number(0)));
  const std::vector<std::uint32_t> cell_part = cell_parts(body), element_part = element_parts(body);
  in_cells.for_each([&](std::uint32_t cell, int corner, std::uint32_t number) {
    const std::optional<Frame> frame = cell_frame(body, cell, corner);
    // In a broken cell the matter stays with its nearest element; the cell lies on the other side of the
    // corner.
    binding.frames[number] = frame ? *frame
                                   : find_frame(body, binding.connections, body.parts[cell_part[cell]],
                                                body.cell_elements[cell][corner], ~corner & 7);
  });
  at_elements.for_each([&](std::uint32_t element, int octant, std::uint32_t number) {
    binding.frames[number] =
        find_frame(body, binding.connections, body.parts[element_part[element]], element, octant);
  });
  resize_touched(binding.frame, anchors.size());
  parallel_for_each(anchors.size(), [&](std::size_t v) {
    binding.frame[v] = (anchors[v].in_cell ? in_cells : at_elements).of(anchors[v].owner, anchors[v].octant);
  });
}

// (frames) Their bases at rest, as apply() builds them anew in each state.
std::vector<Mat3> rest_bases(const Body& body, const Binding& binding) {
  constexpr std::size_t kFramesAtATime = 1024;
  std::vector<Mat3> base;
  resize_touched(base, binding.frames.size());
  parallel_chunks(base.size(), kFramesAtATime, [&](std::size_t begin, std::size_t end) {
    span_bases(&binding.frames[begin], end - begin, body.rest.data(), binding.method->orthonormal,
               &base[begin]);
    for (std::size_t f = begin; f < end; ++f)
      if (binding.frames[f].kind != FrameKind::full)
        base[f] = rest_base(binding.frames[f], body.rest, binding.method->orthonormal);
  });
  return base;
}

// What brings vertices into the rest bases of their frames.
RestFrames rest_frames(const Body& body, const Binding& binding) {
  RestFrames rest;
  rest.base = rest_bases(body, binding);
  resize_touched(rest.to_base, rest.base.size() + 1);
  resize_touched(rest.part, rest.base.size());
  const std::vector<std::uint32_t> part = element_parts(body);
  parallel_for_each(rest.base.size(), [&](std::size_t f) {
    const std::uint32_t origin = binding.frames[f].elements[0];
    rest.to_base[f] << body.rest[origin], rest.base[f].inverse();
    rest.part[f] = part[origin];
  });
  for (const Part& p : body.parts)
    rest.to_spacings.push_back(p.lattice.spacing.cwiseInverse().asDiagonal() * p.lattice.axes.transpose());
  return rest;
}

// The residual and the distance of all vertices; and, for methods that keep them, coordinates and bases.
void take_coordinates(const Body& body, Binding& binding, MethodInput& input) {
  constexpr std::size_t kVerticesAtATime = 8192;
  RestFrames rest = rest_frames(body, binding);
  const std::size_t n = binding.frame.size();
  const bool keep = binding.method->keeps_coordinates;
  if (keep) resize_touched(input.coordinates, n);
  std::vector<Extremes> found(n / kVerticesAtATime + 1);
  parallel_chunks(n, kVerticesAtATime, [&](std::size_t begin, std::size_t end) {
    found[begin / kVerticesAtATime] =
        coordinates_in(rest, &binding.frame[begin], &body.surface.vertices[begin], &binding.referenced[begin],
                       end - begin, keep ? &input.coordinates[begin] : nullptr);
  });
  if (keep) input.rest_base = std::move(rest.base);
  Extremes largest;
  for (const Extremes& chunk : found) largest.include(chunk);
  binding.rest_residual = std::sqrt(largest.squared_residual);
  binding.distance_outside = std::max(0.0, std::sqrt(largest.squared_outside) - kHalfDiagonal);
}

}  // namespace

Binding bind(const Body& body, MapMethod method, std::size_t states) {
  return bind(body, method, locate_vertices(body), states);
}

Binding bind(const Body& body, MapMethod method, VertexAnchors anchors, std::size_t states) {
  Binding binding;
  binding.method = method;
  binding.connections = element_adjacency(body);
  binding.referenced = std::move(anchors.referenced);
  make_frames(body, anchors.anchor, binding);
  MethodInput input{body, binding.connections, anchors.anchor, states, {}, {}};
  take_coordinates(body, binding, input);
  binding.kept = method->bind(input);
  return binding;
}

}  // namespace flexel::mapping
