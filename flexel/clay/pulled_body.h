// A body that stays in equilibrium while tools lead places of it: each solution begins where the last one ended, and keeps its
// tangent and preconditioner while they serve.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "flexel/clay/tool_pose.h"
#include "simulate/equilibrium/newton.h"
#include "simulate/matter/fragments.h"
#include "simulate/scene/scene.h"

namespace flexel::clay {

// Throws InputError: what hands cannot lead (a run in time, modes, buckling, a shape that the scene itself keeps, heat,
// shrinkage, contact, rigid links; with a body also model "quadratic").
void refuse_unled(const simulate::Scene& scene);
void refuse_unled(const simulate::Scene& scene, const Body& body);

class PulledBody {
 public:
  // `body` outlives it. The last `middles.size()` [[move]] of `scene` are tools, turned about these [m, rest]; `arm` [m]: how large
  // one is. Begins at `start` (elements) [m]. Throws InputError: as flexel-simulate would of the scene, and as
  // refuse_unled does.
  PulledBody(const Body& body, simulate::Scene scene, std::vector<Vec3> middles, double arm,
             std::vector<Vec3> start);
  PulledBody(const PulledBody&) = delete;
  PulledBody& operator=(const PulledBody&) = delete;
  ~PulledBody();

  // Moves to equilibrium with tools at `poses`. False, and nothing has changed, where it is not found in `iterations` of Newton's
  // method. `tolerance`: of the residual, relative to loads and reactions. `stop` is asked often, and may throw.
  bool lead(const std::vector<ToolPose>& poses, double tolerance, int iterations,
            const std::function<void()>& stop);

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
  void learn(const std::vector<ToolPose>& poses, const std::vector<Vec3>& before);
  void measure();
  void lead_ties(const std::vector<ToolPose>& poses);

  const Body& body_;
  simulate::Fragments fragments_;
  simulate::Problem problem_;
  std::unique_ptr<simulate::Mechanics> mechanics_;
  simulate::NewtonMemory memory_;
  simulate::State state_;
  std::vector<Vec3> middles_;
  std::vector<std::shared_ptr<simulate::RigidLink>> links_;  // (tools) that the ties follow
  double arm_;
  std::size_t first_tool_ = 0;  // among the ties
  std::vector<ToolPose> poses_;
  std::vector<Felt> felt_;
  // The way that the last motion of the tools led the elements: how they answer to more of it.
  std::vector<ToolPose> way_;
  std::vector<Vec3> answer_;  // (elements) m
  double residual_ = 0;
};

}  // namespace flexel::clay
