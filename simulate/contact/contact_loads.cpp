// A force f at a point acts on its elements by their weights, f_a = w_a f; at a place o from it, as o is now,
// by f (w_a + g_a . F^-1 o). A change of the normal n ~ F^-T N costs dU/dn . dn = -(F^-1 P dU/dn) . dF^T n with
// P = I - n n^T, dF = sum_a du_a (x) g_a: the force n (g_a . F^-1 P dU/dn) on element a, which sums up to a
// couple.
#include "simulate/contact/contact_loads.h"

namespace flexel::simulate {

ContactLoads::ContactLoads(const ContactSurface& surface, const std::vector<std::uint8_t>& parts)
    : surface_(surface), rigid_load_(parts.size(), kNotRigid) {
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (!surface.rigid(p) || !surface.rigid(p)->free || !parts[p]) continue;
    rigid_load_[p] = rigid_loads_.size();
    rigid_loads_.push_back({p});
  }
}

void ContactLoads::clear() {
  for (RigidLoad& load : rigid_loads_) load.force = load.torque = Vec3::Zero();
}

std::array<Vec3, 8> ContactLoads::on_elements(const ContactPoint& point, const PointState& now,
                                              const PointLoad& load, const PairStates& states) const {
  const InterpolationWeights& at = point.at;
  std::array<Vec3, 8> on;
  for (std::uint32_t a = 0; a < at.count; ++a) on[a] = at.weights[a] * load.force;
  if (at.count != 8) return on;
  const Vec3& normal = now.side.normal;
  const Vec3 turned = now.inverse * (load.turning - load.turning.dot(normal) * normal);
  const Mat3 couple = normal * turned.transpose() + load.couple * now.inverse.transpose();
  const std::array<Vec3, 3>& slopes = states.cells().slopes(point.part);
  const Vec3 x = couple * slopes[0], y = couple * slopes[1], z = couple * slopes[2];
  const Vec3 sum = x + y, difference = x - y;
  on[0] -= sum + z, on[1] += difference - z, on[2] -= difference + z, on[3] += sum - z;
  on[4] += z - sum, on[5] += difference + z, on[6] += z - difference, on[7] += sum + z;
  return on;
}

void ContactLoads::add(const State& state, const PairList& list, const PairStates& states, bool rubbing,
                       std::vector<Vec3>& forces) {
  static_assert(sizeof(PointLoad) == sizeof(double) * contact_kernels::kLoadRow);
  const std::vector<std::uint32_t>&pairs = states.acting(), &points = states.acting_points();
  if (pairs.empty()) return;
  loads_.resize(list.points().size());
  for (const std::uint32_t point : points) loads_[point] = {};
  auto* loads = reinterpret_cast<double*>(loads_.data());
  contact_kernel_table().collect(states.view(pairs.data(), pairs.size()),
                                 rubbing ? nullptr : reinterpret_cast<const double*>(states.states().data()),
                                 rubbing ? reinterpret_cast<const double*>(states.rubbing().data()) : nullptr,
                                 loads);
  contact_kernel_table().spread(states.cells().points().data(),
                                reinterpret_cast<const double*>(states.points().data()), points.data(),
                                points.size(), loads, forces.data()->data());
  if (rigid_loads_.empty()) return;
  for (const std::uint32_t number : points) {
    const ContactPoint& point = list.point(number);
    if (rigid_load_[point.part] == kNotRigid) continue;
    const std::array<Vec3, 8> on = on_elements(point, states.points()[number], loads_[number], states);
    RigidLoad& rigid = rigid_loads_[rigid_load_[point.part]];
    for (std::uint32_t a = 0; a < point.at.count; ++a) {
      const std::uint32_t e = point.at.elements[a];
      rigid.force += on[a];
      rigid.torque += (surface_.body().rest[e] + state.displacement[e]).cross(on[a]);
    }
  }
}

std::vector<RigidLoad> ContactLoads::about_centres(const State& state) const {
  const Body& body = surface_.body();
  std::vector<RigidLoad> result = rigid_loads_;
  for (RigidLoad& load : result) {
    const Part& part = body.parts[load.part];
    Vec3 centre = Vec3::Zero();
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      centre +=
          surface_.mass(e) * surface_.rigid(load.part)->per_mass * (body.rest[e] + state.displacement[e]);
    load.torque -= centre.cross(load.force);
  }
  return result;
}

}  // namespace flexel::simulate
