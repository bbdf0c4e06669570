// Connections of model `paper` that flow and break (docs/reference/fracture-plasticity.md).
//
// Fracture: a connection ends where its length passes t = l (1 + elongation), l its length in the lattice
// (Jansson and Vergeest, equation 2 and section 4.2); `elongation` times the factor that the body's columns
// give it (connection_factors()).
//
// Flow: an element has the Kirchhoff stress of its connections, tau = 1/2V sum k e d n (x) n, e the stretch, d the
// length, n the direction, V the voxel. Its deviator s is kept within |s| <= sqrt(2/3) sigma_y(a) by a flow
// g N, N = s / |s|, with
//     g = (|s| - sqrt(2/3) sigma_y(a)) / (1/2V sum k d l (n N n)^2 + 2/3 sigma_y'(a)),
// a the equivalent plastic strain, sigma_y that of PlasticFlow, and a connection's rest length follows by l n G n, G the mean of the flows of its
// two elements (section 3.2). So a pulled bar flows at its yield stress, whatever the lattice's stiffness.
#pragma once
#include "simulate/conditions/kernel_effects.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {

// What happened in one state.
struct ConnectionLosses {
  std::uint64_t broken = 0;               // connections
  double released = 0, plastic_work = 0;  // J, dissipated
  ConnectionLosses& operator+=(const ConnectionLosses& other);
};

class ConnectionYield {
 public:
  // Refers to all but `plan`. `model` gets what it remembers: arrays only of what a part can do.
  ConnectionYield(const Problem& problem, const KernelEffects& plan, PaperModel& model);

  [[nodiscard]] bool acts() const { return flows_ || breaks_; }
  // Breaks and lets flow what passes its limits in `state`, whose forces act on velocities for state.kick from
  // half a step before.
  ConnectionLosses advance(const State& state);
  // What is remembered, in the body: bits of Body::connections cleared, columns "connection_rest" and
  // "plastic_strain" of elements.
  void write(Body& body) const;

 private:
  [[nodiscard]] ConnectionLosses tear(const State& state);
  [[nodiscard]] ConnectionLosses flow(const State& state);
  // Of one element: its flow; adds its equivalent plastic strain.
  [[nodiscard]] Mat3 flow_of(const State& state, std::uint32_t element, double& strain) const;
  [[nodiscard]] double longest(std::uint32_t element, const ConnectionRows::Entry& entry) const;

  const Body& body_;
  PaperModel& model_;
  std::vector<PlasticFlow> flow_;   // (parts)
  std::vector<double> elongation_;  // (parts) infinity: none
  std::vector<double> strength_;    // (entries of the rows) factors; empty: 1
  std::vector<double> yield_;       // (elements) likewise
  std::vector<Mat3> flows_now_;     // (elements)
  bool flows_ = false, breaks_ = false;
};

}  // namespace flexel::simulate
