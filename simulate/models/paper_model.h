// Model `paper`: the centre-placed parts of a body resist by central springs along their connections, and by
// nothing else (Jansson and Vergeest, equations 2, 15 and 22; simulate/models/connections.h).
//
// Springs alone would let matter turn inside out and stay so. As a measure of that every element with
// neighbours along each axis of the lattice has a deformation gradient: by differences between the two
// neighbours along an axis, or between the one and itself. Its determinant J is the volume now over that at
// rest; states with J <= 0 are refused. At a crack, where an element has lost a connection, it says nothing.
//
// Rigid parts have no connections here: they cost nothing and do not bound the step.
#pragma once
#include <string>

#include "simulate/linear/block_matrix.h"
#include "simulate/models/central_spring.h"
#include "simulate/models/connections.h"

namespace flexel::simulate {

// What connections have become since the lattice was made; empty arrays where nothing flows or breaks
// (simulate/paper/connection_yield.h).
struct ConnectionMemory {
  std::vector<double> flowed;        // (entries of the rows) m, change of the rest length
  std::vector<double> strain;        // (elements) equivalent plastic strain
  std::vector<std::uint8_t> broken;  // (entries of the rows) 1: it resists no more
};

// (entries of the rows) The factor on "stiffness", "damping", "strength" or "friction" of each connection: the mean of
// its two elements' (column "WHAT_change" of elements; Jansson and Vergeest, section 3.2) times its own (column
// "connection_WHAT_change", elements x 13, at the element that has the bit in Body::connections), both kept less 1.
// Empty: 1 for all. Throws InputError: a column has another shape, or a factor is not above 0.
[[nodiscard]] std::vector<double> connection_factors(const Body& body, const ConnectionRows& rows,
                                                     const std::string& what);

class PaperModel {
 public:
  // Keeps a reference to the problem's body. Throws InputError: a column of connections is damaged.
  explicit PaperModel(const Problem& problem);

  [[nodiscard]] const ConnectionRows& rows() const { return rows_; }
  // (elements) 1: of a centre-placed part, and simulated
  [[nodiscard]] const std::vector<std::uint8_t>& active() const { return active_; }

  // Elastic energy [J], 1/2 k (d - l)^2 over the connections; infinity where an element has J <= 0.
  [[nodiscard]] double energy(const State& state) const;
  // Adds the forces of the connections on their elements [N].
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  // Adds the damping of the connections [N] with b = tau k (equations 3, 16 and 18), from state.velocity;
  // `damping`: tau of each part [s].
  void add_damping(const State& state, const std::vector<double>& damping, std::vector<Vec3>& forces) const;
  // (parts) 1/s^2: an upper bound on the square of the largest frequency in the state; 0: no connections.
  // With the tension-only tangents k_c of the connections and B_e = sum over those of an element, the energy
  // of a swing is sum_c 1/2 (u_a - u_b) k_c (u_a - u_b) <= sum_e u_e B_e u_e, hence omega^2 <= 2 max eig(B_e)
  // / m_e. `mass` (elements) [kg].
  [[nodiscard]] std::vector<double> frequencies(const State& state, const std::vector<double>& mass) const;
  // Adds minus the derivative of the damping by the velocities [N s/m], which resists them.
  void add_damping_matrix(const State& state, const std::vector<double>& damping, BlockMatrix& matrix) const;
  // Adds the tangent. With `project` without the negative part that compressed connections have.
  void add_stiffness(const State& state, bool project, BlockMatrix& matrix) const;

  struct SmallestVolume {
    double value = 1;  // J
    std::uint32_t element = 0;
  };
  [[nodiscard]] SmallestVolume smallest_volume(const State& state) const;
  // J of an element; 1 where it lacks neighbours along an axis, or has lost a connection.
  [[nodiscard]] double volume_ratio(const State& state, std::uint32_t element) const;

  // One connection, as an entry of the row of `element`: its direction in the lattice; as it is now, from its own
  // rest length (simulate/models/rest_shape.h); its Hooke constant [N/m], 0 of a broken one.
  [[nodiscard]] const ConnectionKind& kind(std::uint32_t element, std::uint8_t which) const {
    return connections_.parts[part_[element]].kinds[which];
  }
  [[nodiscard]] Stretch stretched(const State& state, std::uint32_t element,
                                  const ConnectionRows::Entry& entry) const;
  [[nodiscard]] double stiffness(std::uint32_t element, const ConnectionRows::Entry& entry) const;
  // What the body's columns make of the time of its damping: a factor.
  [[nodiscard]] double damping_factor(const ConnectionRows::Entry& entry) const {
    return damping_factor_.empty() ? 1 : damping_factor_[place(entry)];
  }
  // Its place among the entries of the rows.
  [[nodiscard]] std::size_t place(const ConnectionRows::Entry& entry) const {
    return static_cast<std::size_t>(&entry - rows_.entries.data());
  }
  [[nodiscard]] std::uint32_t part_of(std::uint32_t element) const { return part_[element]; }
  [[nodiscard]] const ConnectionMemory& memory() const { return memory_; }
  [[nodiscard]] ConnectionMemory& memory() { return memory_; }

 private:
  [[nodiscard]] bool is_broken(const ConnectionRows::Entry& entry) const {
    return !memory_.broken.empty() && memory_.broken[place(entry)] != 0;
  }

  const Body& body_;
  Connections connections_;
  ConnectionRows rows_;
  std::vector<std::uint32_t> part_;  // (elements)
  std::vector<std::uint8_t> active_;
  ConnectionMemory memory_;
  // (entries of rows_) of the Hooke constant, and of the time of the damping; empty: 1
  std::vector<double> factor_, damping_factor_;
};

}  // namespace flexel::simulate
