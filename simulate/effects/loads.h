// Loads on the selected surface, or on the selected elements by the matter around them: a total force, spread
// evenly; a force at a remote point and a torque, spread as an averaging link does; a pressure along the
// surface's normals; a pin's bearing load (effects/load_distribution.h). They keep the direction and the
// size that they have at rest (dead loads), or turn with what they act on (followers/follower_load.h).
#pragma once
#include <memory>

#include "simulate/conditions/time_curve.h"
#include "simulate/effects/effect.h"
#include "simulate/followers/follower_load.h"
#include "simulate/input/selection.h"

namespace flexel::simulate {

struct Load {
  Selection where;
  std::optional<Vec3> force;       // N, in total
  std::optional<double> pressure;  // Pa, pushes against the surface
  TimeCurve course = {};           // in timed runs; none: all of it from the start
  std::string name;
  std::string origin;  // "beam.toml:12"
  // Of averaging links
  std::optional<Vec3> at = {};      // m, rest: where `force` acts; nothing: spread evenly
  std::optional<Vec3> torque = {};  // N m, a couple
  bool bearing = false;             // `force` is that of a pin on a cylindrical face
  bool follower = false;            // it turns with what it acts on
};

// The key `follower` of a [[load]].
[[nodiscard]] bool parse_follower(TableReader& reader);

// What a load acts on: polygons or elements. Throws InputError: both.
[[nodiscard]] Selected loaded_by(const Load& load, const Body& body);
// Throws InputError: a pressure or a bearing load, which elements do not take.
void require_load_on_elements(const Load& load);
// Throws InputError: the selected elements hold no matter.
[[noreturn]] void fail_without_matter(const Load& load);

// Forces [N] of a load at points of the surface or of elements that stand for all of it, by its kind. Throws
// InputError: a bearing load on a face that does not look against it, a moment about points on a line.
struct LoadedPoint;
[[nodiscard]] std::vector<Vec3> load_forces(const Load& load, const std::vector<LoadedPoint>& points);
// Its force and torque, turning with the points, which nodes carry (TurningLoad::Carriers). Throws
// InputError: points on a line.
using NodeWeights = std::function<void(std::size_t, const std::function<void(std::uint32_t, double)>&)>;
[[nodiscard]] std::unique_ptr<FollowerLoad> turning_load(const Load& load,
                                                         const std::vector<LoadedPoint>& points,
                                                         const NodeWeights& carriers);

class Loads : public Effect {
 public:
  struct Parameters {
    std::vector<Load> loads;
  };
  static constexpr const char* name = "loads";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Loads> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::work; }
  [[nodiscard]] bool drives() const override { return true; }
  [[nodiscard]] bool constant() const override;
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;

  // Of loads that turn with the body
  [[nodiscard]] bool follows() const override;
  void add_force_change(const State& state, const std::vector<Vec3>& change, bool transposed,
                        std::vector<Vec3>& forces) override;
  void accept(const State& state) override;
  [[nodiscard]] double added_frequency(const State& state, const std::vector<double>& mass) override;
  [[nodiscard]] std::vector<double> memory() const override;
  void restore(const std::vector<double>& memory) override;
  [[nodiscard]] std::vector<double> transfer_state() const override { return memory(); }
  void restore_from(const std::vector<double>& transferred) override { restore(transferred); }

 private:
  struct ElementForce {
    std::uint32_t element = 0;
    Vec3 force = Vec3::Zero();  // N
  };
  struct Spread {  // one load
    std::string name;
    TimeCurve course;
    std::vector<ElementForce> forces;  // ascending by element; none where it follows
    bool couple = false;               // it was given a torque, or a point where its force acts
    std::unique_ptr<FollowerLoad> follower = nullptr;
    Vec3 turn = Vec3::Zero();  // rad, that the follower has turned by where the run has come to
  };
  const Body* body_ = nullptr;
  std::vector<Spread> loads_;
  std::optional<double> added_frequency_;
};

}  // namespace flexel::simulate
