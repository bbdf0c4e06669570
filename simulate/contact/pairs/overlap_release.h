// Release of initial penetrations: parts that begin inside each other are pressed apart slowly.
//
// Every pair remembers its initial penetration and presses only beyond a share of it, which falls from 1 to 0
// along a cubic in the release time, counted from when the later of its parts joined. That changes the stored
// energy of the contacts beside the work of their forces; the energy account enters it as work of "overlap".
#pragma once
#include <utility>

#include "simulate/contact/pairs/pair_memory.h"
#include "simulate/contact/pairs/settings.h"

namespace flexel::simulate {

class OverlapRelease {
 public:
  // `settings`, `surface` and `list` outlive this.
  OverlapRelease(const ContactSettings& settings, const ContactSurface& surface, const PairList& list);

  [[nodiscard]] bool enabled() const { return settings_.release_time > 0; }
  // Parts whose initial penetrations have been found: the first ones, in order of joining.
  [[nodiscard]] std::size_t known_parts() const { return joined_.size(); }
  [[nodiscard]] const std::vector<double>& joined() const { return joined_; }  // (known parts) s
  void set_joined(std::vector<double> times) { joined_ = std::move(times); }
  // All parts are known from here on; new ones joined at `time` [s].
  void add_parts(double time) { joined_.resize(surface_.body().parts.size(), time); }

  // Whether the shares in `state` are those of the last advance().
  [[nodiscard]] bool is_at(const State& state) const { return shares(state) == shares_; }
  // To the shares in `state`. Returns those before.
  std::vector<double> advance(const State& state);
  // m, penetration of a pair without pressure.
  [[nodiscard]] double allowed(const ContactPair& pair, const PairRecord& record) const;
  [[nodiscard]] bool is_releasing(const ContactPair& pair) const {
    return !shares_.empty() && shares_[later_part(pair)] > 0;
  }

  // Initial penetrations of `pairs` (numbers in the list) that come near later, with `depths` [m] as they are,
  // because what is released slides: those of their points in other pairs with the same part or plane. Where
  // there are none, or the pair is far deeper, the penetration that begins to press at its depth.
  void admit(const std::vector<std::uint32_t>& pairs, const std::vector<double>& depths,
             PairMemory& memory) const;

  // Enters the energy [J] that the fall of the shares from `before` has put in, by the forces of the `active`
  // pairs in `states`: the mean before and after the step, as the account enters the work of forces.
  void enter_energy(const std::vector<double>& before, const std::vector<std::uint32_t>& active,
                    const std::vector<PairState>& states, const PairMemory& memory);
  // J, entered since this was called last.
  [[nodiscard]] double take_energy() { return std::exchange(energy_, 0); }

  // For checkpoints: joined(), then shares and their energies; `energy` is what is entered so far.
  [[nodiscard]] double energy() const { return energy_; }
  [[nodiscard]] std::size_t share_count() const { return shares_.size(); }
  void save(std::vector<double>& values) const;
  void restore(std::span<const double> values, std::size_t joined, double energy);

 private:
  [[nodiscard]] std::vector<double> shares(const State& state) const;
  [[nodiscard]] std::uint32_t later_part(const ContactPair& pair) const;
  [[nodiscard]] std::uint64_t other_side(const ContactPair& pair) const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  const PairList& list_;
  std::vector<double> joined_;
  // (parts) of the initial penetrations that is allowed, for pairs whose later part it is; empty before the
  // first advance() of these contacts, or without release.
  std::vector<double> shares_;
  std::vector<double> pressing_;  // (parts) J a share: forces times initial penetrations
  double energy_ = 0;
};

}  // namespace flexel::simulate
