// Objects that the build shows several times become one for each use that changes. What is not in the build, and uses
// that do not change, keep the file's own.
#include <fmt/format.h>

#include <map>
#include <set>

#include "base/error.h"
#include "base/resources.h"
#include "base/units.h"
#include "formats/threemf/threemf_content.h"

namespace flexel {
namespace {

constexpr double kBytesOfElement = 400;  // of memory, a vertex or a triangle with the text between

// A UUID made of another one: the same file gives the same. Version 8 of RFC 9562, "custom".
std::string derived_uuid(const std::string& old, std::size_t copy) {
  std::array<std::uint64_t, 2> halves{};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string text = fmt::format("{}/{}/{}", i, copy, old);
    halves[i] = content_hash({reinterpret_cast<const std::byte*>(text.data()), text.size()});
  }
  const std::uint64_t high = (halves[0] & ~std::uint64_t{0xf000}) | 0x8000;
  const std::uint64_t low = (halves[1] & ~(std::uint64_t{3} << 62)) | std::uint64_t{2} << 62;
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", high >> 32, high >> 16 & 0xffff, high & 0xffff,
                     low >> 48, low & 0xffffffffffff);
}

class OwnObjects {
 public:
  OwnObjects(ThreeMfContent& content, const std::vector<bool>& changes)
      : content_(content), changes_(changes), own_(content.uses().size()), component_(own_.size()) {}

  std::vector<pugi::xml_node> run() {
    count_other_users();
    refuse_too_many();
    // Every copy is made of the object as it came: references are changed once all are there.
    for (std::size_t u = 0; u < own_.size(); ++u)
      if (changes_[u]) give(u);
    for (std::size_t u = 0; u < own_.size(); ++u) refer(u);
    return std::move(own_);
  }

 private:
  // Uses that do not change, and components of objects that the build does not show.
  void count_other_users() {
    std::set<pugi::xml_node> shown;
    for (std::size_t u = 0; u < own_.size(); ++u) {
      shown.insert(content_.uses()[u].object);
      if (!changes_[u]) others_.insert(content_.uses()[u].object);
    }
    for (auto& [path, model] : content_.models())
      for (const auto& [id, object] : model.objects)
        if (!shown.contains(object)) add_users_of(model, object);
  }

  void add_users_of(const ThreeMfModel& model, const pugi::xml_node& object) {
    for_each_xml_child(xml_child(object, "components"), "component", [&](const pugi::xml_node& component) {
      std::string_view path = xml_value(component, "path");
      while (path.starts_with('/')) path.remove_prefix(1);
      const auto other = content_.models().find(path.empty() ? model.path : std::string(path));
      if (other == content_.models().end()) return;
      const auto found = other->second.objects.find(xml_value(component, "objectid"));
      if (found != other->second.objects.end()) others_.insert(found->second);
    });
  }

  void refuse_too_many() const {
    double elements = 0;
    std::set<pugi::xml_node> seen = others_;
    for (std::size_t u = 0; u < own_.size(); ++u) {
      const ThreeMfUse& use = content_.uses()[u];
      if (changes_[u] && !seen.insert(use.object).second) elements += use.vertices + use.triangles;
    }
    if (kBytesOfElement * elements > .8 * available_memory())
      content_.fail(
          fmt::format("shows its objects so often that a copy for each needs {} of memory, more than is "
                      "free: write another format",
                      human_bytes(kBytesOfElement * elements)));
  }

  void give(std::size_t u) {
    const ThreeMfUse& use = content_.uses()[u];
    use.model->changed = true;
    if (!others_.contains(use.object) && taken_.insert(use.object).second) {
      own_[u] = use.object;
      return;
    }
    // Objects come before those that show them, and so do their copies.
    const auto [last, is_first] = last_copy_.try_emplace(use.object, use.object);
    own_[u] = use.object.parent().insert_copy_after(use.object, last->second);
    last->second = own_[u];
    xml_attribute(own_[u], "id").set_value(free_id(*use.model).c_str());
    renew_uuids(own_[u]);
  }

  void renew_uuids(pugi::xml_node object) {
    ++copies_;
    const auto renew = [&](const pugi::xml_node& node) {
      if (pugi::xml_attribute uuid = xml_attribute(node, "UUID"))
        uuid.set_value(derived_uuid(uuid.value(), copies_).c_str());
    };
    renew(object);
    for_each_xml_child(xml_child(object, "components"), "component", renew);
  }

  // The number after the largest that a resource of the model has; ids of 3MF are below 2^31.
  std::string free_id(const ThreeMfModel& model) {
    constexpr std::size_t kEnd = std::size_t{1} << 31;
    const auto [entry, is_new] = next_id_.try_emplace(&model, 1);
    if (is_new)
      for (const pugi::xml_node& resource : xml_child(model.node, "resources").children())
        if (std::size_t id = 0; whole_number(xml_value(resource, "id"), kEnd, id))
          entry->second = std::max(entry->second, id + 1);
    if (entry->second >= kEnd) content_.fail("has ids so large that none is left for a copy of an object");
    return std::to_string(entry->second++);
  }

  // The item or component that shows the use names its object. In a copy it is the component of the same number:
  // the uses of an object's components follow in their order.
  void refer(std::size_t u) {
    const ThreeMfUse& use = content_.uses()[u];
    pugi::xml_node shown_by = use.shown_by;
    if (use.parent != ThreeMfUse::kNone) {
      if (!changes_[use.parent]) return;
      shown_by = component_[use.parent] = next_component(own_[use.parent], component_[use.parent]);
    }
    if (own_[u] == pugi::xml_node() || own_[u] == use.object) return;
    if (use.parent == ThreeMfUse::kNone) content_.root().changed = true;
    xml_attribute(shown_by, "objectid").set_value(xml_attribute(own_[u], "id").value());
  }

  // The first one where there is none before.
  static pugi::xml_node next_component(const pugi::xml_node& object, const pugi::xml_node& last) {
    pugi::xml_node next = last ? last.next_sibling() : xml_child(object, "components").first_child();
    while (next && local_name(next.name()) != "component") next = next.next_sibling();
    return next;
  }

  ThreeMfContent& content_;
  const std::vector<bool>& changes_;
  std::vector<pugi::xml_node> own_,
      component_;  // (uses) the object; its component that was gone through last
  std::set<pugi::xml_node> others_, taken_;
  std::map<pugi::xml_node, pugi::xml_node> last_copy_;
  std::map<const ThreeMfModel*, std::size_t> next_id_;
  std::size_t copies_ = 0;
};

}  // namespace

std::vector<pugi::xml_node> own_objects(ThreeMfContent& content, const std::vector<bool>& changes) {
  return OwnObjects(content, changes).run();
}

std::vector<bool> with_parents(const ThreeMfContent& content, std::vector<bool> leaves) {
  for (std::size_t u = leaves.size(); u-- > 0;)
    if (leaves[u] && content.uses()[u].parent != ThreeMfUse::kNone) leaves[content.uses()[u].parent] = true;
  return leaves;
}

}  // namespace flexel
