// A force f at a point acts on its elements by their weights, f_a = w_a f; at a place o from it, as o is now,
// by f (w_a + g_a . F^-1 o). A change of the normal n ~ F^-T N costs dU/dn . dn = -(F^-1 P dU/dn) . dF^T n with
// P = I - n n^T, dF = sum_a du_a (x) g_a: the force n (g_a . F^-1 P dU/dn) on element a, which sums up to a
// couple.
#include "simulate/contact/contact_loads.h"

namespace flexel::simulate {

ContactLoads::ContactLoads(const ContactSurface& surface, const std::vector<std::uint8_t>& parts)
    : surface_(surface) {
  for (std::uint32_t p = 0; p < parts.size(); ++p)
    if (surface.rigid(p) && surface.rigid(p)->free && parts[p]) rigid_loads_.push_back({p});
}

void ContactLoads::clear() {
  for (RigidLoad& load : rigid_loads_) load.force = load.torque = Vec3::Zero();
}

void ContactLoads::add(const State& state, const PairList& list, const std::vector<PointState>& points,
                       const std::vector<PointLoad>& loads, std::vector<Vec3>& forces) {
  const Body& body = surface_.body();
  for (std::uint32_t n = 0; n < loads.size(); ++n) {
    const PointLoad& load = loads[n];
    const ContactPoint& point = list.point(n);
    if (load.force == Vec3::Zero() && load.turning == Vec3::Zero()) continue;
    RigidLoad* rigid = nullptr;
    for (RigidLoad& each : rigid_loads_)
      if (each.part == point.part) rigid = &each;
    const auto add_force = [&](std::uint32_t element, const Vec3& force) {
      forces[element] += force;
      if (!rigid) return;
      rigid->force += force;
      rigid->torque += (body.rest[element] + state.displacement[element]).cross(force);
    };
    for (std::uint32_t a = 0; a < point.at.count; ++a)
      add_force(point.at.elements[a], point.at.weights[a] * load.force);
    if (point.at.count != 8) continue;
    const Vec3& normal = points[n].side.normal;
    const Vec3 turned = points[n].inverse * (load.turning - load.turning.dot(normal) * normal);
    const Mat3 couple = normal * turned.transpose() + load.couple * points[n].inverse.transpose();
    for (std::size_t a = 0; a < 8; ++a)
      add_force(point.at.elements[a], couple * surface_.gradients(point.part)[a]);
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
