// The template page/page.html, whose @NAMES@ are filled in. All text of files is JSON: the page shows it as text.
#include "flexel/view/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/printable.h"
#include "base/units.h"
#include "base/version.h"
#include "flexel/picture/canvas/colour_map.h"
#include "flexel/picture/render/quantity.h"
#include "flexel/picture/render/render.h"
#include "flexel/view/pack.h"
#include "flexel/view/page_files.h"

namespace flexel::view {
namespace {

using Json = nlohmann::ordered_json;

// A name, and whether it is what it looks like: only then can it be copied.
Json name_json(const std::string& name) {
  const std::string shown = printable(name);
  return {{"text", shown}, {"odd", shown != name}};
}

template <std::size_t N>
std::vector<std::uint32_t> flat(const std::vector<std::array<std::uint32_t, N>>& rows) {
  std::vector<std::uint32_t> all;
  all.reserve(N * rows.size());
  for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
  return all;
}

// Points of one number stand together, or each has one of its own and the numbers say nothing.
bool shares_normals(const Shape& shape) {
  std::uint32_t most = 0;
  for (const std::uint32_t number : shape.smooth) most = std::max(most, number);
  return !shape.smooth.empty() && most + std::size_t{1} != shape.smooth.size();
}

bool is_moved(const Drawn& drawn) {
  return std::any_of(drawn.displacement.begin(), drawn.displacement.end(), [](const auto& state) {
    return std::any_of(state.begin(), state.end(), [](const Vec3& u) { return u != Vec3::Zero(); });
  });
}

Json pack_drawn(const Drawn& drawn, const std::string& at, ArrayPack& pack) {
  const Shape& shape = drawn.shape;
  pack.add_points(at + "/rest", shape.rest);
  pack.add_indices(at + "/triangles", flat(shape.triangles));
  pack.add_indices(at + "/face", shape.face);
  pack.add_indices(at + "/creases", flat(shape.creases));
  pack.add_indices(at + "/borders", flat(shape.borders));
  if (shares_normals(shape)) pack.add_indices(at + "/smooth", shape.smooth);
  if (!drawn.colours.empty()) pack.add_bytes(at + "/colours", drawn.colours);
  if (!drawn.carriers.empty()) {
    pack.add_indices(at + "/carriers", drawn.carriers);
    pack.add_numbers(at + "/weights", drawn.weights);
  }
  const bool moved = is_moved(drawn);
  if (moved)
    for (std::size_t f = 0; f < drawn.displacement.size(); ++f)
      pack.add_points(fmt::format("{}/displacement/{}", at, f), drawn.displacement[f]);
  Json fields = Json::array();
  for (const Field& field : drawn.fields) {
    for (std::size_t f = 0; f < field.values.size(); ++f)
      pack.add_numbers(fmt::format("{}/field/{}/{}", at, fields.size(), f), field.values[f]);
    Json about = {{"name", field.name}, {"frames", field.values.size()}};
    if (field.largest && std::isfinite(*field.largest)) about["largest"] = *field.largest;
    fields.push_back(about);
  }
  return {{"frames", drawn.displacement.size()}, {"moved", moved}, {"fields", fields}};
}

// The largest absolute value of each attribute, by name.
std::map<std::string, double> largest_values(const std::vector<ViewFile>& files) {
  std::map<std::string, double> largest;
  for (const ViewFile& file : files)
    for (const Drawn* drawn :
         {file.surface ? &*file.surface : nullptr, file.lattice ? &*file.lattice : nullptr}) {
      if (drawn == nullptr) continue;
      double& length = largest["displacement"];
      for (const auto& state : drawn->displacement)
        for (const Vec3& u : state) length = std::max(length, u.norm());
      for (const Field& field : drawn->fields) {
        double most = -1;  // no value is finite
        for (const auto& state : field.values)
          for (const double value : state)
            if (std::isfinite(value)) most = std::max(most, std::abs(value));
        if (most >= 0) largest[field.name] = std::max(largest[field.name], most);
      }
      largest["/size"] = std::max(largest["/size"], bounding_box(drawn->shape.rest).size().maxCoeff());
    }
  return largest;
}

Json units_json(const std::vector<ViewFile>& files) {
  Json units = Json::object();
  for (const auto& [name, value] : largest_values(files)) {
    const auto dimension = name == "/size" ? Dimension::length : picture::dimension_of(name);
    const picture::DisplayUnit unit = picture::display_unit(dimension, value);
    units[name] = {{"factor", unit.factor}, {"name", unit.name}};
  }
  return units;
}

std::string hex(const picture::Colour& colour) {
  const auto byte = [&](Eigen::Index a) { return static_cast<int>(std::lround(255 * colour[a])); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2));
}

Json colours_json() {
  constexpr int kEntries = 256, kTints = 8;
  Json palette = Json::array(), tints = Json::array();
  for (int i = 0; i < kEntries; ++i)
    palette.push_back(hex(picture::colour_of(static_cast<float>(i) / (kEntries - 1))));
  for (std::uint32_t i = 0; i < kTints; ++i) tints.push_back(hex(picture::part_tint(i)));
  return {{"palette", palette}, {"tints", tints}, {"nothing", hex(picture::colour_of_nothing())}};
}

// Unless it is there: what a stage of flexel deform tells has the scene's name before it among those of the command.
void add_different(const std::string& text, Json& warnings) {
  for (Json& each : warnings) {
    const auto there = each.get<std::string>();
    if (there.ends_with(text)) return;
    if (!text.ends_with(there)) continue;
    each = text;
    return;
  }
  warnings.push_back(text);
}

void collect_warnings(const Json& value, Json& warnings) {
  if (!value.is_structured()) return;
  for (const auto& [key, inner] : value.items()) {
    if (!value.is_object() || key != "warnings" || !inner.is_array()) {
      collect_warnings(inner, warnings);
      continue;
    }
    for (const Json& each : inner)
      add_different(each.is_string() ? printable(each.get<std::string>()) : json_text(each), warnings);
  }
}

Json words_json(const RunWords& words) {
  Json summary, warnings = Json::array(), lines = Json::array();
  for (const std::string& line : words.warnings) warnings.push_back(printable(line));
  for (const std::string& line : words.lines) lines.push_back(printable(line));
  if (!words.summary.empty()) {
    summary = parse_json(words.summary);
    if (!summary.is_object()) throw InputError("--summary: is no summary (JSON) of a run");
    collect_warnings(summary, warnings);
  }
  return {{"warnings", warnings}, {"lines", lines}, {"summary", summary}};
}

// JSON within <script>: no "</script" and no "<!--".
std::string within_script(const Json& json) {
  std::string out;
  for (const char c : json_text(json)) c == '<' ? out += "\\u003c" : out += c;
  return out;
}

std::string base64(const Bytes& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

// The template with "@NAME@" replaced, once through: what is put in is not looked at.
std::string filled(std::string_view text, const std::map<std::string, std::string_view>& values) {
  std::string out;
  while (true) {
    const std::size_t at = text.find('@'), end = at == text.npos ? at : text.find('@', at + 1);
    if (end == text.npos) return out.append(text);
    const auto found = values.find(std::string(text.substr(at + 1, end - at - 1)));
    if (found == values.end()) {  // an "@" of the template's own
      out.append(text.substr(0, end));
      text.remove_prefix(end);
      continue;
    }
    out.append(text.substr(0, at)).append(found->second);
    text.remove_prefix(end + 1);
  }
}

std::string html_of(const Json& page, const std::string& data, bool whole) {
  const PageFiles& files = page_files();
  const std::string text = within_script(page);
  // Repeatable, and not to be guessed by what the data holds: nothing of it is HTML.
  const std::string nonce = fmt::format("{:016x}", content_hash(std::as_bytes(std::span(text))));
  return filled(files.html, {{"POLICY", content_policy(nonce, whole)},
                             {"NONCE", nonce},
                             {"STYLE", files.style},
                             {"LICENCE", files.licence},
                             {"THREE", files.three},
                             {"PAGE", text},
                             {"DATA", data},
                             {"SCRIPT", files.script}});
}

}  // namespace

Bytes pack_file(const ViewFile& file, bool quick) {
  ArrayPack pack(quick ? kQuickLevel : kUsualLevel);
  Json about = {{"label", printable(file.label)}};
  about["parts"] = Json::array();
  for (const std::string& part : file.parts) about["parts"].push_back(name_json(part));
  about["face_names"] = Json::object();
  std::vector<std::uint32_t> parts;
  for (std::size_t f = 0; f < file.faces.size(); ++f) {
    parts.push_back(file.faces[f].part);
    if (!file.faces[f].name.empty()) about["face_names"][std::to_string(f)] = printable(file.faces[f].name);
  }
  pack.add_indices("face_part", parts);
  pack.add_indices("face_number", file.face_numbers);
  about["times"] = file.times;
  about["facts"] = Json::array();
  for (const auto& [name, text] : file.facts) about["facts"].push_back({printable(name), printable(text)});
  if (file.surface) about["surface"] = pack_drawn(*file.surface, "surface", pack);
  if (file.lattice) about["lattice"] = pack_drawn(*file.lattice, "lattice", pack);
  return pack.finish(json_text(about));
}

std::string content_policy(const std::string& nonce, bool whole) {
  return fmt::format(
      "default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; img-src data: blob:; media-src "
      "blob:; "
      "connect-src {1}; base-uri 'none'; form-action 'none'",
      nonce, whole ? "'none'" : "'self'");
}

Page make_page(const std::vector<ViewFile>& files, const PageOptions& options, bool whole) {
  Page page;
  Json json = {{"version", version()},
               {"whole", whole},
               {"up", std::string(1, options.up)},
               {"colour", options.colour},
               {"scale", nullptr},
               {"colours", colours_json()},
               {"units", units_json(files)},
               {"words", words_json(options.words)}};
  if (!options.clay.empty()) json["clay"] = parse_json(options.clay);
  if (options.exaggeration) json["scale"] = *options.exaggeration;
  json["files"] = Json::array();
  std::string data;
  for (const ViewFile& file : files) {
    Bytes bytes = pack_file(file);
    json["files"].push_back({{"label", printable(file.label)}, {"bytes", bytes.size()}});
    if (whole)
      data += "<script type=\"application/octet-stream\" class=\"data\">" + base64(bytes) + "</script>\n";
    else
      page.data.push_back(std::move(bytes));
  }
  page.html = html_of(json, data, whole);
  return page;
}

void write_page(const std::vector<ViewFile>& files, const PageOptions& options, double limit,
                const std::string& option, const std::string& path) {
  const Page page = make_page(files, options, true);
  if (static_cast<double>(page.html.size()) > limit)
    throw PageTooLarge(fmt::format(
        "{}: the page would have {}, more than {}: show fewer files or frames, or raise the limit{}", path,
        human_bytes(static_cast<double>(page.html.size())), human_bytes(limit), option));
  write_text(page.html, path);
}

std::size_t page_weight() {
  return html_of(Json::object(), "", true).size();
}

}  // namespace flexel::view
