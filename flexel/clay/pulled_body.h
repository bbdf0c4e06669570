// A body that stays in equilibrium while tools lead places of it: each solution begins where the last one ended, and keeps its
// tangent and preconditioner while they serve. While a hand moves it follows roughly.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "flexel/clay/answers.h"
#include "simulate/equilibrium/newton.h"
#include "simulate/indent/indenter_shape.h"
#include "simulate/matter/fragments.h"
#include "simulate/scene/scene.h"

namespace flexel::clay {

// Throws InputError: what hands cannot lead (a run in time, modes, buckling, a shape that the scene itself keeps, heat,
// shrinkage, contact, rigid links, other indenters than the hands' `pushers`; with a body also model "quadratic").
void refuse_unled(const simulate::Scene& scene, std::size_t pushers = 0);
void refuse_unled(const simulate::Scene& scene, const Body& body, std::size_t pushers = 0);

// m: how far along `away` a tool has to be from `place` to be clear of the part as it is moved by `now` and as `scene`
// finds it, in this order, the second from where the first ends. Nothing: it is clear nowhere near.
[[nodiscard]] std::optional<std::array<double, 2>> ways_clear(const Body& body, const simulate::Scene& scene,
                                                              const simulate::IndenterShape& shape,
                                                              const simulate::IndenterPlace& place,
                                                              const Vec3& away, const std::vector<Vec3>& now);

// The name of an [[indenter]] of `scene` that is led through the part, both as it is moved by `now` and while it comes there
// from the shape that `scene` finds; "": of none.
[[nodiscard]] std::string led_through(const Body& body, const simulate::Scene& scene,
                                      const std::vector<Vec3>& now);

inline constexpr double kRest = 1e-8;  // the residual of a part at rest

struct LedTool {
  Vec3 middle = Vec3::Zero();  // m, rest: it turns about this
  bool pushes = false;         // an [[indenter]], else a [[move]]
};

class PulledBody {
 public:
  // `body` outlives it. The last [[move]] and [[indenter]] of `scene` are the tools, in their order; `arm` [m]: how large one is.
  // Begins at `start` (elements) [m] with the tools at `started`. Throws InputError: as flexel-simulate would of the scene, and
  // as refuse_unled does.
  PulledBody(const Body& body, simulate::Scene scene, std::vector<LedTool> tools, double arm,
             std::vector<Vec3> start, std::vector<ToolPose> started);
  PulledBody(const PulledBody&) = delete;
  PulledBody& operator=(const PulledBody&) = delete;
  ~PulledBody();

  // Moves to equilibrium with tools at `poses`. False, and nothing has changed, where it is not found in `iterations` of Newton's
  // method. `tolerance`: of the residual, relative to loads and reactions. `stop` is asked often, and may throw. A tool that
  // pushes goes no further at once than ClayTool::steps() says.
  bool lead(const std::vector<ToolPose>& poses, double tolerance, int iterations,
            const std::function<void()>& stop);

  // Moves near the equilibrium with tools at `poses`: to a residual of `tolerance`, with the tangent that is there while it serves,
  // at a fraction of what lead() costs. False, and nothing has changed, where that is not enough.
  bool follow(const std::vector<ToolPose>& poses, double tolerance);
  // Back to where lead() found an equilibrium to kRest last, or where it began.
  void retreat();

  struct Felt {
    Vec3 force = Vec3::Zero(),
         torque = Vec3::Zero();  // N, N m about the tool's middle as it is now: by the part
  };
  [[nodiscard]] const std::vector<Felt>& felt() const { return felt_; }                        // (tools)
  [[nodiscard]] const std::vector<ToolPose>& poses() const { return poses_; }                  // (tools)
  [[nodiscard]] const std::vector<Vec3>& displacement() const { return state_.displacement; }  // (elements) m
  [[nodiscard]] double residual() const { return residual_; }
  // As a run leaves it: loose crumbs carried along.
  [[nodiscard]] std::vector<Vec3> whole_displacement() const;
  // `body` with its present shape as the rest shape. Throws DivergedError.
  void renormalise(Body& body) const;

 private:
  [[nodiscard]] bool solve(const std::vector<ToolPose>& poses, double tolerance, int iterations,
                           bool predicted, const std::function<void()>& stop);
  struct Iterate {
    simulate::State state;
    simulate::Forces forces;
    std::vector<Vec3> unbalanced;   // (elements) N, on free components
    double left = 0, residual = 0;  // N, their norm; relative
  };
  [[nodiscard]] Iterate iterate(simulate::State state);
  [[nodiscard]] bool improve(Iterate& at, double tolerance);
  [[nodiscard]] double touch(Iterate& at, bool renew);
  [[nodiscard]] bool improve_touching(Iterate& at, double tolerance);
  void renew_tangent(const simulate::State& state);
  void accept(simulate::State state, const std::vector<ToolPose>& poses, double residual);
  void measure(const std::vector<Vec3>& unbalanced);
  void lead_ties(const std::vector<ToolPose>& poses);

  const Body& body_;
  simulate::Fragments fragments_;
  simulate::Problem problem_;
  std::unique_ptr<simulate::Mechanics> mechanics_;
  simulate::NewtonMemory memory_;
  simulate::State state_;
  std::vector<LedTool> tools_;
  std::vector<std::shared_ptr<simulate::RigidLink>> links_;  // (tools) that ties and indenters follow
  std::vector<std::size_t> reaction_;                        // (tools) numbers of theirs
  std::vector<ToolPose> poses_;
  std::vector<Felt> felt_;
  Answers answers_;
  std::vector<Vec3> rested_;                                   // (elements) m, at the last equilibrium
  std::vector<ToolPose> rested_poses_;                         // (tools) likewise
  double residual_ = 0, rested_residual_ = 0, strongest_ = 0;  // 1; 1; N, of a tool so far
};

}  // namespace flexel::clay
