// Gravity on every cell's matter, f rho V, an eighth of it on each of the cell's elements; at centre
// placement on that of the element's voxel. Three kinds, which add up (Jansson and Vergeest, section 3.2 and
// equations 1 and 13):
//     uniform   F = m g, energy -m g . u
//     source    F = G m M (s - x) / |s - x|^3, energy -G m M / |s - x|, for each mass M at a point s: one that is given,
//               or the centre of mass of a part, which is drawn by as much, evenly by mass, and not by itself
//     mutual    the same of every element on every other (simulate/gravitation/gravity_sum.h)
// The last two act in timed runs only.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/gravitation/gravity_sum.h"

namespace flexel::simulate {

class Gravity : public Effect {
 public:
  struct Source {
    Vec3 at = Vec3::Zero();              // m, world frame
    double mass = 0;                     // kg; 0 of a part: its own
    std::string part = {}, origin = {};  // whose centre of mass it is instead, where it goes; "scene.toml:3"
  };
  static constexpr double kNewton = 6.6743e-11;  // m^3/kg/s^2, CODATA 2018
  struct Parameters {
    std::optional<Vec3> acceleration;  // m/s^2, world frame
    std::vector<Source> sources = {};
    bool mutual = false;
    double constant = kNewton;  // m^3/kg/s^2, G
  };
  static constexpr const char* name = "gravity";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Gravity> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::potential; }
  [[nodiscard]] bool drives() const override { return true; }
  [[nodiscard]] bool needs_time() const override { return mutual_ || !sources_.empty(); }
  [[nodiscard]] bool constant() const override { return !needs_time(); }
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  // So that a step turns no orbit by more than 2 / 60 rad: 60^2 times what attraction adds.
  [[nodiscard]] double added_frequency(const State& state, const std::vector<double>& mass) override;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;

 private:
  // A source that is a part: its elements, and their mass [kg].
  struct OfPart {
    std::uint32_t begin = 0, end = 0;
    double mass = 0;
  };
  [[nodiscard]] OfPart find_part(Source& source, const Body& body) const;
  // The elements with mass, where they are now.
  [[nodiscard]] PointMasses points(const State& state) const;
  [[nodiscard]] Attraction attraction(const State& state) const;
  // Of the sources, which are at `places` [m].
  [[nodiscard]] Pull pull(const std::vector<Vec3>& places, const State& state, std::size_t element) const;
  [[nodiscard]] std::vector<Vec3> source_places(const State& state) const;
  void add_source_forces(const State& state, std::vector<Vec3>& forces) const;

  Vec3 acceleration_ = Vec3::Zero();
  std::vector<Source> sources_;
  std::vector<OfPart> of_parts_;  // (sources_) without elements: at a point that is given
  bool mutual_ = false;
  double constant_ = kNewton;
  std::vector<double> mass_;            // (elements) kg
  Vec3 first_moment_ = Vec3::Zero();    // kg m, sum of mass times rest position
  std::vector<double> radius_;          // (elements) m, half the spacing; with sources or mutual
  std::vector<Vec3> rest_;              // (elements) m, likewise
  std::vector<std::uint32_t> massive_;  // elements with mass, ascending; with mutual
};

}  // namespace flexel::simulate
