// State that pairs carry from step to step: stick-slip, adhesion, phase, initial penetration, and how softly
// they began to press. Beside the
// displacements for which the list of pairs was made it is all of contact that the present state of the body
// does not determine.
#pragma once
#include <span>

#include "simulate/contact/pairs/pair_list.h"

namespace flexel::simulate {

// Surfaces meet from outside. A pair that comes near with more penetration than a step can give is one that
// something else keeps apart, or a wall that was passed: it is `penetrated` and exerts no force until it has
// separated. Its force would release energy that no approach has stored.
enum class PairPhase : std::uint8_t { separated, approaching, penetrated };

// A row of simulate/kernels/kernel_contact.h.
struct PairRecord {
  static constexpr double kFree = -1;
  std::uint64_t key = 0;
  Vec3 slip = Vec3::Zero();  // m, extension of the spring along the surface that resists sliding
  double adhesion = kFree;   // m, the gap at which adhesion pulls nothing; kFree: it does not stick
  PairPhase phase = PairPhase::separated;
  double penetration = 0;  // m, initial: a share of it is allowed while it is released
  double soft = 0;         // m, of the soft part of the contact law, where that is wider than at rest

  [[nodiscard]] bool sticks() const { return adhesion != kFree; }
  void release_adhesion() { adhesion = kFree; }
};

class PairMemory {
 public:
  [[nodiscard]] PairRecord* data() { return records_.data(); }
  [[nodiscard]] PairRecord& operator[](std::size_t pair) { return records_[pair]; }
  [[nodiscard]] const PairRecord& operator[](std::size_t pair) const { return records_[pair]; }

  // To a new list: records of pairs that are in it still are kept, others begin anew.
  void follow(const std::vector<ContactPair>& pairs);

  // For checkpoints: kValues a pair.
  static constexpr std::size_t kValues = 9;
  [[nodiscard]] std::size_t size() const { return records_.size(); }
  void save(std::vector<double>& values) const;
  void restore(std::span<const double> values);

  // For the contacts of a body that an event has changed, where points have other numbers: they are known by
  // part, position and normal at rest, a plane by -1 and its number; a pair by both and its record. Pairs that
  // are not there any more are left out. Planes are numbered behind the points.
  void save_by_position(const std::vector<ContactPoint>& points, std::vector<double>& values) const;
  void restore_by_position(const std::vector<ContactPoint>& points, std::size_t planes,
                           std::span<const double> values);

 private:
  std::vector<PairRecord> records_;  // (pairs), ascending by key; before the first list those taken over
};

}  // namespace flexel::simulate
