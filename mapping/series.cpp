// VTK's collection file, read with pugixml.
#include "mapping/series.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <pugixml.hpp>

#include "base/error.h"
#include "base/files/named_file.h"

namespace flexel::mapping {
namespace {

pugi::xml_node read_collection(const std::string& pvd, pugi::xml_document& document) {
  const Bytes bytes = read_all(pvd);
  const pugi::xml_parse_result parsed = document.load_buffer(bytes.data(), bytes.size());
  const pugi::xml_node collection = document.child("VTKFile").child("Collection");
  if (!parsed || !collection)
    throw InputError(pvd, "is no series of frames (a .pvd file of VTK): take what flexel-simulate wrote");
  return collection;
}

}  // namespace

std::vector<double> series_times(const std::string& pvd) {
  pugi::xml_document document;
  std::vector<double> times;
  for (const pugi::xml_node set : read_collection(pvd, document).children("DataSet")) {
    const double time = set.attribute("timestep").as_double(std::nan(""));
    times.push_back(std::isfinite(time) ? time : static_cast<double>(times.size()));
  }
  return times;
}

std::vector<std::string> series_files(const std::string& pvd) {
  pugi::xml_document document;
  const pugi::xml_node collection = read_collection(pvd, document);
  const std::filesystem::path folder = std::filesystem::path(pvd).parent_path();
  std::vector<std::string> files;
  for (const pugi::xml_node set : collection.children("DataSet")) {
    const std::string file = set.attribute("file").value();
    if (file.empty()) throw InputError(pvd, fmt::format("frame {} names no file", files.size() + 1));
    files.push_back((folder / file).string());
    refuse_device(files.back(), pvd);
  }
  if (files.empty()) throw InputError(pvd, "the series lists no frame");
  return files;
}

std::string frame_name(const std::string& pattern, std::size_t number) {
  const std::string text = fmt::format("{:05}", number), key = "{frame}";
  std::string name = pattern;
  const std::size_t at = name.find(key);
  if (at != std::string::npos) return name.replace(at, key.size(), text);
  const std::string ending = extension(pattern);
  const std::size_t dot = ending.empty() ? name.size() : name.size() - ending.size() - 1;
  return name.insert(dot, "_" + text);
}

bool same_lattice(const Body& a, const Body& b) {
  return a.rest == b.rest && a.lattice_index == b.lattice_index && a.cell_elements == b.cell_elements &&
         a.broken == b.broken && a.connections == b.connections;
}

}  // namespace flexel::mapping
