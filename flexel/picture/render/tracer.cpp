// Embree 3: one geometry a scene, rays in packets of sixteen (Embree splits them where registers are
// narrower). Robust traversal, so that no ray passes between two triangles.
#include "flexel/picture/render/tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <new>
#include <stdexcept>

#include "base/error.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"

namespace flexel::picture {
namespace {

constexpr std::size_t kPacket = 16;

struct alignas(64) Lanes {
  std::array<int, kPacket> valid{};
};

void set_ray(RTCRay16& packet, std::size_t i, const Ray& ray) {
  packet.org_x[i] = ray.origin.x();
  packet.org_y[i] = ray.origin.y();
  packet.org_z[i] = ray.origin.z();
  packet.dir_x[i] = ray.direction.x();
  packet.dir_y[i] = ray.direction.y();
  packet.dir_z[i] = ray.direction.z();
  packet.tnear[i] = ray.near;
  packet.tfar[i] = ray.far;
  packet.time[i] = 0;
  packet.mask[i] = 0xffffffffu;
  packet.id[i] = static_cast<unsigned>(i);
  packet.flags[i] = 0;
}

[[noreturn]] void fail(RTCDevice device) {
  if (rtcGetDeviceError(device) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (!can_start_a_thread())  // Embree does not tell this from other errors
    throw InputError(
        "no thread can be started, and a picture needs some: raise the limits of this shell (ulimit -u)");
  throw std::runtime_error("Embree could not build its tree");
}

}  // namespace

struct Tracer::State {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = nullptr;

  State() {
    if (device == nullptr) {
      if (rtcGetDeviceError(nullptr) != RTC_ERROR_UNSUPPORTED_CPU) throw std::bad_alloc();
      throw std::runtime_error("Embree does not start on this processor");
    }
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  }
  ~State() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // A buffer of the geometry, filled with `source`, whose items are as large as `format` says.
  template <class Item>
  void fill(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const std::vector<Item>& source) {
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Item), source.size());
    if (buffer == nullptr) fail(device);
    std::copy(source.begin(), source.end(), static_cast<Item*>(buffer));
  }
  void finish(RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    const auto tell = [](void*, double share) {
      tell_share(share);
      return true;
    };
    rtcSetSceneProgressMonitorFunction(scene, tell, nullptr);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) fail(device);
  }
};

Tracer::Tracer(const std::vector<Vec3f>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles)
    : state_(std::make_unique<State>()) {
  RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  state_->fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices);
  state_->fill(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
  state_->finish(geometry);
}

Tracer::Tracer(const std::vector<Eigen::Vector4f>& spheres) : state_(std::make_unique<State>()) {
  RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  state_->fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, spheres);
  state_->finish(geometry);
}

Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

void Tracer::intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RTCRayHit16 packet{};  // lanes without a ray hold numbers too
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - begin);
    Lanes lanes;
    for (std::size_t i = 0; i < count; ++i) {
      lanes.valid[i] = -1;
      set_ray(packet.ray, i, rays[begin + i]);
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(lanes.valid.data(), state_->scene, &context, &packet);
    for (std::size_t i = 0; i < count; ++i) {
      const bool met = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      hits[begin + i] =
          met ? Hit{packet.hit.primID[i], packet.ray.tfar[i], packet.hit.u[i], packet.hit.v[i]} : Hit{};
    }
  }
}

void Tracer::occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay16 packet{};
  for (std::size_t begin = 0; begin < rays.size(); begin += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - begin);
    Lanes lanes;
    for (std::size_t i = 0; i < count; ++i) {
      lanes.valid[i] = -1;
      set_ray(packet, i, rays[begin + i]);
    }
    rtcOccluded16(lanes.valid.data(), state_->scene, &context, &packet);
    // Embree marks a ray that met something by a far end of minus infinity.
    for (std::size_t i = 0; i < count; ++i) blocked[begin + i] = packet.tfar[i] < 0 ? 1 : 0;
  }
}

}  // namespace flexel::picture
