// [run] resolution = "adaptive": parts that are strained or touched become finer, and calm ones coarser, by
// events `resolution` that the run decides on itself. docs/reference/events.md#adaptive-resolution
//
// Strain: the largest difference of the strain between neighbouring cells (simulate/matter/strain_jump.h),
// which a finer lattice halves. Contact: the smallest gap, in spacings of the present lattice. What makes a
// part coarser is at most half of what makes it finer, by both, and has held for the least time; so a change
// does not call for the one back.
#pragma once
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "simulate/conditions/part_touch.h"
#include "simulate/events/event.h"
#include "simulate/input/adaptive_settings.h"

namespace flexel::simulate {

class AdaptiveResolution {
 public:
  // `duration` s, of the run. Throws InputError: the body has no part of a name.
  AdaptiveResolution(const AdaptiveSettings& settings, const Body& body, double duration);

  // Whether changes are due in this state, of each part one at most; not at a time that was looked at
  // already, but at the start. `touches` (parts). A part for which there is no room stays, with a warning,
  // told once.
  [[nodiscard]] bool look(const Problem& problem, const State& state, const std::vector<PartTouch>& touches,
                          Progress& progress);
  // What is due since, as events.
  [[nodiscard]] std::vector<Event> take_due() { return std::exchange(due_, {}); }
  // Share of the energy that these may change without a warning.
  [[nodiscard]] double energy_borne() const { return energy_borne_; }

  // Why a body, which has `now` elements, has no room for that many within --max-elements, memory and the
  // scene's own limit; empty: it has.
  [[nodiscard]] static std::string beyond_limits(const AdaptiveSettings& settings, double elements,
                                                 double now);
  // The numbers of the parts that it may change, ascending. Throws InputError as above.
  [[nodiscard]] static std::vector<std::uint32_t> parts_of(const AdaptiveSettings& settings,
                                                           const Body& body);

  [[nodiscard]] std::string plan() const;  // for --explain

  // For checkpoints. restore() throws InputError: it is of another body.
  [[nodiscard]] std::vector<double> memory() const;
  void restore(const std::vector<double>& memory);

 private:
  struct PartLevel {
    std::uint32_t part = 0;
    int level = 0;  // halvings of its spacing since the run began
    // s: the last change, whether it made it coarser, and since when it has been calm
    double changed = 0;
    bool coarsened = false;
    double calm_since = 0, largest = 0;  // and its largest difference of strain since
    double no_room =
        std::numeric_limits<double>::infinity();  // elements of a body in which it had none to be finer
  };
  [[nodiscard]] std::string wants_finer(const PartLevel& of, double jump, double gap, double now) const;
  [[nodiscard]] bool wants_coarser(PartLevel& of, double jump, double gap, double now) const;

  // Whether it may become finer in a body of `elements`, which become those of then.
  [[nodiscard]] bool has_room(const Body& body, PartLevel& of, double& elements, Progress& progress);

  AdaptiveSettings settings_;
  double least_time_;
  double looked_ = -1;  // s, when it was looked last
  std::vector<PartLevel> parts_;
  [[nodiscard]] double bearable_change(const PartLevel& of) const;

  std::vector<Event> due_;
  double energy_borne_ = 0;
  bool told_limit_ = false;
};

}  // namespace flexel::simulate
