// Seats are turned into frames, one for each distinct seat: a byte a cell (and a byte an element) records
// which of its eight octants are taken, and a running count numbers them. Then each vertex gets its
// coordinates in the rest base of its frame, which is all that the paper's transformation (section 6.1.2)
// needs later.
#include "mapping/bind.h"

#include <Eigen/LU>
#include <atomic>
#include <bit>
#include <cmath>

#include "formats/bucket.h"
#include "mapping/frame_kernel.h"
#include "mapping/kernel.h"
#include "mapping/search.h"
#include "mapping/seat.h"

namespace flexel {
namespace {

// Numbers the octants that are taken, owner by owner.
class OctantNumbers {
 public:
  explicit OctantNumbers(std::size_t owners) : taken_(owners, 0), first_(owners) {}
  void take(std::uint32_t owner, int octant) {
    std::atomic_ref<std::uint8_t>(taken_[owner])
        .fetch_or(static_cast<std::uint8_t>(1u << octant), std::memory_order_relaxed);
  }
  // Numbers from `next`; returns what follows the last.
  std::uint32_t number(std::uint32_t next) {
    for (std::size_t owner = 0; owner < taken_.size(); ++owner) {
      first_[owner] = next;
      next += static_cast<std::uint32_t>(std::popcount(taken_[owner]));
    }
    return next;
  }
  [[nodiscard]] std::uint32_t of(std::uint32_t owner, int octant) const {
    const unsigned below = taken_[owner] & ((1u << octant) - 1u);
    return first_[owner] + static_cast<std::uint32_t>(std::popcount(below));
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

void make_frames(const Body& body, const std::vector<Seat>& seats, Binding& binding) {
  OctantNumbers in_cells(body.cell_count()), at_elements(body.element_count());
  parallel_for_each(seats.size(), [&](std::size_t v) {
    (seats[v].in_cell ? in_cells : at_elements).take(seats[v].owner, seats[v].octant);
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
  resize_touched(binding.frame, seats.size());
  parallel_for_each(seats.size(), [&](std::size_t v) {
    binding.frame[v] = (seats[v].in_cell ? in_cells : at_elements).of(seats[v].owner, seats[v].octant);
  });
}

// Largest values over the vertices: m^2, and spacings^2 from the origin of its frame.
struct Extremes {
  double squared_residual = 0, squared_outside = 0;
  void operator+=(const Extremes& other) {
    squared_residual = std::max(squared_residual, other.squared_residual);
    squared_outside = std::max(squared_outside, other.squared_outside);
  }
};

// (frames) Their bases at rest, as apply() builds them anew in each state.
std::vector<Mat3> rest_bases(const Body& body, const Binding& binding) {
  constexpr std::size_t kFramesAtATime = 1024;
  std::vector<Mat3> base;
  resize_touched(base, binding.frames.size());
  parallel_chunks(base.size(), kFramesAtATime, [&](std::size_t begin, std::size_t end) {
    span_bases(&binding.frames[begin], end - begin, body.rest.data(),
               binding.method == MapMethod::gram_schmidt, &base[begin]);
    for (std::size_t f = begin; f < end; ++f)
      if (binding.frames[f].kind != FrameKind::full)
        base[f] = rest_base(binding.frames[f], body.rest, binding.method);
  });
  return base;
}

void take_coordinates(const Body& body, Binding& binding) {
  std::vector<Mat3> base = rest_bases(body, binding), inverse;
  resize_touched(inverse, base.size());
  parallel_for_each(base.size(), [&](std::size_t f) { inverse[f] = base[f].inverse(); });
  std::vector<Mat3> to_spacings;  // (parts)
  for (const Part& part : body.parts)
    to_spacings.push_back(part.lattice.spacing.cwiseInverse().asDiagonal() * part.lattice.axes.transpose());
  const std::vector<std::uint32_t> part = element_parts(body);
  const bool keep = binding.method == MapMethod::affine || binding.method == MapMethod::gram_schmidt;
  if (keep) resize_touched(binding.coordinates, binding.frame.size());
  const Extremes extremes = parallel_sum<Extremes>(binding.frame.size(), [&](std::size_t v) {
    const std::uint32_t f = binding.frame[v], origin = binding.frames[f].elements[0];
    const Vec3& point = body.surface.vertices[v];
    const Vec3 away = point - body.rest[origin], coordinates = inverse[f] * away;
    if (keep) binding.coordinates[v] = coordinates;
    if (!binding.referenced[v]) return Extremes{};
    return Extremes{(body.rest[origin] + base[f] * coordinates - point).squaredNorm(),
                    (to_spacings[part[origin]] * away).squaredNorm()};
  });
  if (keep) binding.rest_base = std::move(base);
  binding.rest_residual = std::sqrt(extremes.squared_residual);
  binding.distance_outside = std::max(0.0, std::sqrt(extremes.squared_outside) - kHalfDiagonal);
}

}  // namespace

Binding bind(const Body& body, MapMethod method, std::size_t states) {
  return bind(body, method, take_seats(body), states);
}

Binding bind(const Body& body, MapMethod method, Seats seats, std::size_t states) {
  Binding binding;
  binding.method = method;
  binding.connections = element_adjacency(body);
  binding.referenced = std::move(seats.referenced);
  make_frames(body, seats.seat, binding);
  take_coordinates(body, binding);
  if (method == MapMethod::blended)
    binding.blend = make_blend(body, binding.connections, seats.seat, states > 1);
  if (method == MapMethod::smooth)
    binding.groups = group_vertices(body, binding.connections, seats.seat, kSmoothSteps, kSmoothRadius);
  return binding;
}

}  // namespace flexel
