// Joints between rigid parts, or of one with the world: what of their relative motion each takes away.
//
// Impulses along the derivative of the constraints at the pose before a step, so large that the constraints hold at
// the pose after it (SHAKE: Ryckaert, Ciccotti and Berendsen 1977; that it is symplectic: Leimkuhler and Skeel 1994):
// nothing drifts, nothing has to be stabilised, and energy swings about its value with the square of the step.
// On the two parts they are opposite and act at the same point, so that momentum and angular momentum are kept. Found by
// Newton's method with the matrix G M^-1 G^T of the pose before the step. Where joints hold the same motion twice, as
// those of a plane linkage do, their forces are the smallest that do it.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {

// hinge: turns about its axis; slider: moves along it; ball: turns about its point; motor: a hinge that is driven.
enum class JointKind : std::uint8_t { hinge, slider, ball, motor };

struct Joint {
  JointKind kind = JointKind::hinge;
  std::string name, origin;          // "bend.toml:12"
  std::array<std::string, 2> parts;  // the second "": the world
  Vec3 at = Vec3::Zero();            // m, at rest
  Vec3 axis = Vec3::Zero();          // unit, at rest; of all but balls
  // Of motors: how fast the first part turns about the axis against the second, and what couple [N m] it takes at most
  // for that (nothing: whatever it needs); without a speed it is the couple.
  std::optional<double> speed, torque;  // rad/s, N m
};

// A rigid part in a step.
struct JointedBody {
  const RigidBody* body = nullptr;  // as the step begins
  bool led = false;
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();  // kg m/s, kg m2/s: with all impulses; joints add theirs
  Pose next;                                          // of those led; of the others it is found
};

class JointSystem {
 public:
  static constexpr std::size_t kWorld = SIZE_MAX;
  struct Side {
    std::size_t body = kWorld;   // number among the bodies
    Vec3 centre = Vec3::Zero();  // m, at rest
  };
  struct Place {
    Joint joint;
    std::array<Side, 2> sides;
  };
  // `size`: m, of the whole body. `duration`: s, of the run.
  JointSystem(std::vector<Place> places, double size, double duration);

  // Throws InputError: the two sides are not where the joint was made, a part can move no more, or velocities are such
  // as joints do not allow. `fresh`: takes the little from velocities that they do not. The state is the bodies'.
  void begin(std::span<JointedBody> bodies, bool fresh);
  // One step of `drift` s after impulses of `kick` s. Throws DivergedError: the joints cannot hold.
  void advance(std::span<JointedBody> bodies, double kick, double drift);

  // Of the last step.
  struct Reaction {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // N, N m, on the first part; about the joint's point
    double travel = 0;  // rad or m, of hinges, motors and sliders: from rest; 0 of balls
    double drive = 0;   // N m, of motors
  };
  [[nodiscard]] const std::vector<Reaction>& reactions() const { return reactions_; }
  // W: of motors, and of what leads led parts against the joints, with the velocities before the step's impulses and
  // after them.
  struct Power {
    double motors = 0, supports = 0;
  };
  [[nodiscard]] const Power& before() const { return before_; }
  [[nodiscard]] const Power& after() const { return after_; }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

  // 1/s^2, as a bound on the square of a frequency: steps turn no part by more than .01 rad and pass no more than that of
  // the swing of a pendulum whose joint bears what these do on average.
  [[nodiscard]] double frequency(std::span<const RigidBody* const> bodies);
  // s: of the first steps, from which it is seen what the joints bear; infinity once it is.
  [[nodiscard]] double first_step() const;
  // Whether a part spins much faster than that knows of.
  [[nodiscard]] bool is_exceeded() const { return steps_ < kFirstSteps || fastest_ > kFaster * rate_; }

  [[nodiscard]] std::vector<double> memory() const;
  [[nodiscard]] bool restore(const std::vector<double>& memory);

 private:
  static constexpr double kFaster = 1.25;
  static constexpr int kFirstSteps = 2;
  struct Frame;
  struct Rows;
  [[nodiscard]] Frame frame(const Place& place, std::size_t side, const Pose& pose) const;
  [[nodiscard]] static Pose pose_of(std::span<const JointedBody> bodies, const Side& side, bool next);
  [[nodiscard]] Eigen::VectorXd misfit(std::span<const JointedBody> bodies, bool next) const;
  [[nodiscard]] Rows rows(std::span<const JointedBody> bodies, bool motors) const;
  [[nodiscard]] double travelled(const Place& place, const Frame& first, const Frame& second,
                                 double near) const;
  void refuse_turned_over(const Place& place, std::span<const JointedBody> bodies) const;
  void refuse_locked(std::span<const JointedBody> bodies) const;
  void refuse_speeds(std::span<JointedBody> bodies) const;
  void forget_rates();
  [[nodiscard]] Eigen::VectorXd misfit_of_step(std::span<const JointedBody> bodies, const Rows& rows,
                                               double drift) const;
  void push(std::span<JointedBody> bodies, const Rows& rows, const Eigen::VectorXd& impulses) const;
  [[nodiscard]] Eigen::VectorXd hold(std::span<JointedBody> bodies, const Rows& rows, double kick,
                                     double drift);
  [[nodiscard]] bool is_too_fast(std::span<const JointedBody> bodies, const Rows& rows,
                                 const Eigen::VectorXd& given, double drift) const;
  void find(std::span<JointedBody> bodies, const Rows& rows, const std::vector<Eigen::Index>& open,
            double drift, Eigen::VectorXd& impulses) const;
  using Velocity = std::array<Vec3, 2>;  // m/s, of the centre of mass; rad/s
  void tell(std::span<const JointedBody> bodies, const Rows& rows, const Eigen::VectorXd& impulses,
            double kick);
  [[nodiscard]] Power powers(std::span<const JointedBody> bodies,
                             const std::vector<Velocity>& velocities) const;

  std::vector<Place> places_;
  double size_, duration_;
  std::vector<double> travel_;  // (places) rad or m
  std::vector<double>
      stalled_;  // (places) 1, -1: the motor gave all of its couple in the last step, that way; else 0
  std::vector<Reaction> reactions_;
  Power before_, after_;
  std::vector<Velocity> on_led_;  // (bodies) N, N m: of joints, about the centre of mass
  // of the steps since frequency() was asked
  std::vector<Vec3> borne_;        // (2 places) N s, by the joint's sides
  std::vector<Vec3> spun_;         // (bodies) rad/s, what their angular velocity grew by
  double lasted_ = 0;              // s
  double fastest_ = 0, rate_ = 0;  // rad/s: now; the most that frequency() has seen
  int steps_ = 0;                  // of the first ones, taken
};

}  // namespace flexel::simulate
