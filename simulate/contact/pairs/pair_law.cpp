// The derivatives of U in the order of the header.
#include "simulate/contact/pairs/pair_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexel::simulate {
namespace {

struct Smooth {
  double value = 0, slope = 0;
};

// K over t^2, and its derivative.
Smooth kernel(double squared, double width) {
  if (!(width > 0)) return {1, 0};
  const double per_square = 1 / (width * width);
  const double q = 1 - squared * per_square;
  if (!(q > 0)) return {};
  const double scale = (3 / std::numbers::pi) * per_square;
  return {scale * q * q, -2 * scale * q * per_square};
}

// 0 below `from`, 1 above `to`, a cubic between.
Smooth ramp(double at, double from, double to) {
  const double per_length = 1 / (to - from);
  const double s = (at - from) * per_length;
  if (s <= 0) return {};
  if (s >= 1) return {1, 0};
  return {s * s * (3 - 2 * s), 6 * s * (1 - s) * per_length};
}

// Under a law of its own.
void press(PairState& now, const ContactSide& i, const ContactSide& j, const NormalLaw& normal_law) {
  const NormalLaw::Value law = normal_law.at(-now.gap);
  now.stiffness = now.weight * law.stiffness;
  now.energy = now.pressure = now.share = 0;
  now.force = now.turning[0] = now.turning[1] = Vec3::Zero();
  if (!(law.pressure > 0)) return;
  now.share = normal_law.share(-now.gap);
  now.energy = now.weight * law.energy;
  now.pressure = now.weight * law.pressure;
  const double spread = now.narrowing * law.energy;  // N/m, of t
  now.force = now.pressure * now.normal + spread * now.offset;
  if (now.length > 0) {
    const Vec3 tilt = (spread * now.along - now.pressure) / now.length * now.offset;
    now.turning = {i.own_plane * tilt, -j.own_plane * tilt};
  }
  if (now.facing_slope > 0) {
    const double turn = now.facing_slope * law.energy;
    now.turning[0] -= turn * j.normal;
    now.turning[1] -= turn * i.normal;
  }
}

}  // namespace

PairState pair_state(const ContactSide& i, const ContactSide& j, const PairConstants& pair, double allowed,
                     double soft) {
  PairState now;
  const Vec3 d = j.position - i.position;
  const double far = std::max(pair.limit, pair.width);
  if (pair.width > 0 && d.squaredNorm() > pair.width * pair.width + far * far) return now;
  const bool faces = i.normal != Vec3::Zero() && j.normal != Vec3::Zero();
  const Smooth facing =
      faces ? ramp(-i.normal.dot(j.normal), pair.facing_from, pair.facing_fully) : Smooth{1, 0};
  if (!(facing.value > 0)) return now;
  const Vec3 b = i.own_plane * i.normal - j.own_plane * j.normal;
  const double length = b.norm();
  const bool balls = i.radius > 0 && j.radius > 0;
  if (!balls && !(length > 0)) return now;  // two that have no plane of their own
  now.normal = balls ? d.normalized() : Vec3((1 / length) * b);
  now.along = d.dot(now.normal);
  now.gap = now.along - i.radius - j.radius + allowed;
  now.offset = balls ? Vec3(Vec3::Zero()) : Vec3(d - now.along * now.normal);
  const Smooth k = kernel(now.offset.squaredNorm(), pair.width);
  if (!(k.value > 0)) return now;
  now.near = true;
  now.deep = now.gap < -pair.limit;
  if (now.deep) return now;
  now.weight = pair.stiffness * k.value * facing.value;
  now.length = balls ? 0 : length;
  now.narrowing = -2 * pair.stiffness * k.slope * facing.value;
  now.facing_slope = pair.stiffness * k.value * facing.slope;
  press(now, i, j, pair.law.softened(soft));
  return now;
}

}  // namespace flexel::simulate
