// Writes 3MF again from 3MF: the source's archive with other coordinates in its models; everything else stays as it
// was, files that nobody changed with their packed bytes. The hierarchy and its transforms stay too, and the new
// coordinates of an object are its deformed vertices taken back through them: a transform of 3MF can always be inverted,
// placements and UUIDs keep their meaning, and what did not move keeps its digits. An object that is shown several times
// becomes one for each use that moved (own_objects()). The unit stays the file's own.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

#include "base/error.h"
#include "base/files/output_file.h"
#include "base/stop.h"
#include "formats/common/surface_writers.h"
#include "formats/threemf/threemf_content.h"

namespace flexel {
namespace {

class ThreeMfRewrite {
 public:
  explicit ThreeMfRewrite(const DeformedSurface& deformed)
      : source_(deformed.surface.sources[0]),
        content_(source_.bytes, source_.file, ThreeMfText::all),
        displacement_(deformed.displacement) {
    if (source_.order.empty()) return;
    displacement_.clear();
    for (const std::uint32_t v : source_.order) displacement_.push_back(deformed.displacement.at(v));
  }

  Bytes run() {
    const std::vector<ThreeMfUse>& uses = content_.uses();
    std::size_t vertices = 0;
    for (const ThreeMfUse& use : uses) vertices += use.vertices;
    if (vertices != displacement_.size())
      content_.fail("the embedded 3MF has another number of vertices than the surface");
    std::vector<bool> moved(uses.size());
    for (std::size_t u = 0; u < uses.size(); ++u) moved[u] = moves(uses[u]);
    moved = with_parents(content_, std::move(moved));
    if (std::find(moved.begin(), moved.end(), true) == moved.end()) return source_.bytes;
    std::vector<pugi::xml_node> own = own_objects(content_, moved);
    for (std::size_t u = 0; u < uses.size(); ++u) {
      if (!own[u]) continue;
      drop_slices(own[u]);
      if (moves(uses[u])) move(uses[u], own[u]);
    }
    return content_.packed();
  }

 private:
  [[nodiscard]] bool moves(const ThreeMfUse& use) const {
    const auto begin = displacement_.begin() + use.first_vertex;
    return std::any_of(begin, begin + use.vertices, [](const Vec3& d) { return d != Vec3::Zero(); });
  }

  // They show the object at rest; the reader said so.
  static void drop_slices(pugi::xml_node object) {
    for (const char* name : {"slicestackid", "meshresolution"}) {
      const pugi::xml_attribute found = xml_attribute(object, name);
      if (found) object.remove_attribute(found);
    }
  }

  void move(const ThreeMfUse& use, const pugi::xml_node& object) const {
    check_stop();
    const Mat3 linear = use.transform.leftCols<3>();
    const Mat3 back = linear.inverse();
    if (!back.allFinite() || !((back * linear - Mat3::Identity()).norm() < 1e-6))
      content_.fail(
          fmt::format("the transform of object \"{}\" flattens it, so that no coordinates can show the part "
                      "deformed: write another format",
                      shown_text(xml_value(object, "id"))));
    std::size_t v = 0;
    for_each_xml_child(
        xml_child(xml_child(object, "mesh"), "vertices"), "vertex", [&](const pugi::xml_node& vertex) {
          const Vec3& displacement = displacement_[use.first_vertex + v++];
          if (displacement == Vec3::Zero()) return;
          const Vec3 rest = content_.position(vertex, v), change = back * displacement / content_.unit();
          constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
          for (std::size_t i = 0; i < 3; ++i) {
            const auto axis = static_cast<Eigen::Index>(i);
            if (change[axis] != 0)
              xml_attribute(vertex, kAxes[i]).set_value(fmt::format("{}", rest[axis] + change[axis]).c_str());
          }
        });
  }

  const SurfaceSource& source_;
  ThreeMfContent content_;
  std::vector<Vec3> displacement_;  // (vertices of the file x 3) m
};

}  // namespace

void rewrite_3mf(const DeformedSurface& deformed, OutputFile& out) {
  const Bytes bytes = ThreeMfRewrite(deformed).run();
  out.write(bytes.data(), bytes.size());
}

}  // namespace flexel
