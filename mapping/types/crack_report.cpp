// Text and JSON for the pieces. The text sums up debris, which may be thousands of pieces.
#include "mapping/types/crack_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/error.h"
#include "base/files/json.h"
#include "base/nearest_word.h"
#include "base/units.h"

namespace flexel::mapping {
namespace {

const std::vector<std::string> kModes = {"keep", "open", "cap"};  // by CrackMode

constexpr std::size_t kNamed = 4;  // pieces with a line each in the text

std::string piece_line(const CrackReport& report) {
  std::vector<const CrackPiece*> pieces;
  std::size_t debris = 0;
  double debris_volume = 0;
  for (const CrackPiece& piece : report.pieces) {
    debris += piece.debris;
    if (piece.debris) debris_volume += piece.volume_before;
    if (!piece.debris) pieces.push_back(&piece);
  }
  const bool volumes = report.mode == CrackMode::cap;
  const auto with_volume = [&](double volume) { return volumes ? " of " + human_volume(volume) : ""; };
  std::string line = fmt::format("{} pieces", human_count(pieces.size()));
  std::vector<std::string> named;
  for (std::size_t p = 0; p < std::min(pieces.size(), kNamed); ++p)
    named.push_back(fmt::format("\"{}\"{}", pieces[p]->name, with_volume(pieces[p]->volume_before)));
  line += fmt::format(": {}{}", fmt::join(named, ", "), pieces.size() > kNamed ? ", ..." : "");
  if (debris > 0)
    line += fmt::format("; debris: {} single elements{}{}", human_count(debris), with_volume(debris_volume),
                        report.dropped() > 0 ? ", left out" : "");
  return line;
}

}  // namespace

CrackMode crack_mode(const std::string& name) {
  const auto found = std::find(kModes.begin(), kModes.end(), name);
  if (found != kModes.end()) return static_cast<CrackMode>(found - kModes.begin());
  throw InputError(fmt::format("unknown word \"{}\": --crack is {}{}", name, fmt::join(kModes, ", "),
                               did_you_mean(name, kModes)));
}

std::string name_of(CrackMode mode) {
  return kModes[static_cast<std::size_t>(mode)];
}

std::size_t CrackReport::dropped() const {
  return static_cast<std::size_t>(
      std::count_if(pieces.begin(), pieces.end(), [](const CrackPiece& piece) { return piece.dropped; }));
}

double CrackReport::dropped_volume() const {
  double volume = 0;
  for (const CrackPiece& piece : pieces)
    if (piece.dropped) volume += piece.volume_before;
  return volume;
}

std::vector<std::string> crack_lines(const CrackReport& report) {
  std::vector<std::string> lines;
  if (!report.pieces.empty()) lines.push_back(piece_line(report));
  if (report.spanning_triangles > 0)
    lines.push_back(
        fmt::format("{} triangles are stretched across a crack: --crack open or cap parts the surface there",
                    human_count(report.spanning_triangles)));
  else if (report.mode == CrackMode::keep && report.cracked_parts > 0)
    lines.push_back(fmt::format(
        "{} {} cracks that end inside, over which the surface is stretched: --crack open or cap opens them",
        human_count(report.cracked_parts), report.cracked_parts == 1 ? "part has" : "parts have"));
  return lines;
}

std::string crack_json(const CrackReport& report) {
  nlohmann::ordered_json json;
  json["mode"] = name_of(report.mode);
  json["fragments"] = report.fragments;
  json["cracked_parts"] = report.cracked_parts;
  json["spanning_triangles"] = report.spanning_triangles;
  if (report.pieces.empty()) return json_text(json);
  const bool volumes = report.mode == CrackMode::cap;
  nlohmann::ordered_json& pieces = json["pieces"] = nlohmann::ordered_json::array();
  for (const CrackPiece& piece : report.pieces) {
    nlohmann::ordered_json one;
    one["name"] = piece.name;
    one["part"] = piece.part;
    one["elements"] = piece.elements;
    one["debris"] = piece.debris;
    one["dropped"] = piece.dropped;
    if (volumes) {
      one["volume_before"] = piece.volume_before;
      if (!piece.dropped) one["volume_after"] = piece.volume_after;
    }
    pieces.push_back(one);
  }
  json["dropped_pieces"] = report.dropped();
  if (volumes) json["dropped_volume"] = report.dropped_volume();
  return json_text(json);
}

}  // namespace flexel::mapping
