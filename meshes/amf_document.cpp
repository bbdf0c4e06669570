// ISO/ASTM 52915: an instance is turned by rx, ry and rz degrees about x, then y, then z, and then displaced.
#include "meshes/amf_document.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "base/error.h"
#include "formats/common/readers.h"

namespace flexel::meshes {
namespace {

constexpr std::size_t kMostUses = 100'000;
constexpr int kDeepest = 64;

Eigen::Matrix4d transform_of(const pugi::xml_node& instance, const std::string& where) {
  const auto value = [&](const char* name) {
    const double number = instance.child(name).text().as_double(0);
    if (!std::isfinite(number))
      throw InputError(where, fmt::format("is damaged: <{}> is not a finite number", name));
    return number;
  };
  const auto turn = [&](const char* name, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(value(name) * std::numbers::pi / 180, axis).toRotationMatrix();
  };
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = turn("rz", Eigen::Vector3d::UnitZ()) *
                                    turn("ry", Eigen::Vector3d::UnitY()) *
                                    turn("rx", Eigen::Vector3d::UnitX());
  transform.topRightCorner<3, 1>() << value("deltax"), value("deltay"), value("deltaz");
  return transform;
}

class Constellations {
 public:
  Constellations(const pugi::xml_node& amf, const std::string& where) : where_(where) {
    for (const pugi::xml_node& object : amf.children("object"))
      objects_.insert(object.attribute("id").value());
    for (const pugi::xml_node& each : amf.children("constellation")) {
      constellations_[each.attribute("id").value()] = each;
      for (const pugi::xml_node& instance : each.children("instance"))
        used_.insert(instance.attribute("objectid").value());
    }
  }

  // Constellations that no other shows, and objects that none does.
  std::vector<AmfDocument::Use> uses() {
    for (const auto& [id, constellation] : constellations_)
      if (used_.count(id) == 0) show(constellation, Eigen::Matrix4d::Identity(), 0);
    for (const std::string& id : objects_)
      if (used_.count(id) == 0) uses_.push_back({id, Eigen::Matrix4d::Identity()});
    return std::move(uses_);
  }

 private:
  void show(const pugi::xml_node& constellation, const Eigen::Matrix4d& above, int depth) {
    if (depth > kDeepest || uses_.size() > kMostUses)
      throw InputError(
          where_, "is damaged: its constellations contain one another, or show 100,000 objects and more");
    for (const pugi::xml_node& instance : constellation.children("instance")) {
      const std::string id = instance.attribute("objectid").value();
      const Eigen::Matrix4d transform = above * transform_of(instance, where_);
      if (const auto found = constellations_.find(id); found != constellations_.end())
        show(found->second, transform, depth + 1);
      else if (objects_.count(id) > 0)
        uses_.push_back({id, transform});
      else
        throw InputError(where_, fmt::format("is damaged: it shows object \"{}\", which is not there",
                                             clean_name(id.substr(0, 60))));
    }
  }

  const std::string& where_;
  std::set<std::string> objects_, used_;
  std::map<std::string, pugi::xml_node> constellations_;
  std::vector<AmfDocument::Use> uses_;
};

}  // namespace

AmfDocument amf_document(const Bytes& bytes, const std::string& where) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(bytes.data(), bytes.size(), pugi::parse_default | pugi::parse_declaration);
  if (!parsed)
    throw InputError(where, fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
  AmfDocument result;
  pugi::xml_node amf = document.child("amf");
  result.uses = Constellations(amf, where).uses();
  for (const pugi::xml_node& object : amf.children("object")) {
    const pugi::xml_node name = object.find_child_by_attribute("metadata", "type", "name");
    if (name) result.names[object.attribute("id").value()] = name.text().get();
  }
  while (amf.remove_child("constellation")) {
  }
  std::ostringstream text;
  document.save(text, "", pugi::format_raw);
  const std::string written = text.str();
  const auto* begin = reinterpret_cast<const std::byte*>(written.data());
  result.bytes.assign(begin, begin + written.size());
  return result;
}

}  // namespace flexel::meshes
