// Pairs of lines: a group code, and its value. Code 0 begins an entity, 9 a variable of the header; 70 of a POLYLINE are
// its flags, 71 to 74 of a VERTEX the corners of a face; 8 is the layer of an entity, of a LAYER itself 2 is the name, 70
// with bit 1 means frozen, a negative 62 off (AutoCAD's DXF reference).
#include "meshes/dxf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <span>

#include "base/error.h"

namespace flexel::meshes {
namespace {

bool among(std::string_view word, std::span<const std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// 0 where it is none.
int whole(std::string_view text) {
  int value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

// Names of layers have no case.
std::string upper(std::string_view text) {
  std::string made(text);
  for (char& c : made)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return made;
}

[[noreturn]] void refuse(const std::string& where, std::string_view what, const char* cure) {
  throw InputError(where, fmt::format("holds {}, which assimp does not read right: {}", what, cure));
}

// Of $INSUNITS; 0: not said.
double dxf_unit(int code, const std::string& where) {
  constexpr double kInch = 0.0254, kFoot = 0.3048;
  constexpr std::pair<int, double> kUnits[] = {
      {0, 0},          {1, kInch},  {2, kFoot}, {3, 5280 * kFoot},  {4, 1e-3},
      {5, 1e-2},       {6, 1},      {7, 1e3},   {8, 1e-6 * kInch},  {9, 1e-3 * kInch},
      {10, 3 * kFoot}, {11, 1e-10}, {12, 1e-9}, {13, 1e-6},         {14, 0.1},
      {15, 10},        {16, 100},   {17, 1e9},  {21, 1200.0 / 3937}};
  for (const auto& [known, metres] : kUnits)
    if (code == known) return metres;
  throw InputError(
      where, fmt::format("is in the unit number {} ($INSUNITS), which is not known: export it in mm", code));
}

class DxfScanner {
 public:
  DxfScanner(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  DxfDocument scan() {
    const auto* begin = reinterpret_cast<const std::byte*>(text_.data());
    document_.bytes.assign(begin, begin + text_.size());
    bool ended = false;
    for (at_ = 0; at_ < text_.size();) {
      const std::string_view code = next_line(), value = next_line();
      ended = code == "0" && value == "EOF";
      if (ended) break;
      if (code == "0") entity_ = value, left_out_ = false;
      if (code == "9") variable_ = value;
      if (code == "0" && value == "ENDSEC") section_ = "";
      if (code == "2" && entity_ == "SECTION") section_ = value;
      if (section_ == "HEADER" && variable_ == "$INSUNITS" && code == "70")
        document_.unit = dxf_unit(whole(value), where_);
      if (section_ == "TABLES" && entity_ == "LAYER") look_at_layer(code, value);
      if (section_ == "ENTITIES") look_at(code, value);
    }
    if (!ended) throw InputError(where_, "is cut off: DXF ends with EOF, and this does not");
    return std::move(document_);
  }

 private:
  // Without blanks at its ends.
  std::string_view next_line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.remove_suffix(1);
    return line;
  }

  void look_at_layer(std::string_view code, std::string_view value) {
    if (code == "2") layer_ = value;
    if ((code == "70" && (whole(value) & 1) != 0) || (code == "62" && value.starts_with('-')))
      hidden_.insert(upper(layer_));
  }

  // The entity becomes one that nobody knows.
  void leave_out(const char* why) {
    if (left_out_) return;
    left_out_ = true;
    document_.bytes[static_cast<std::size_t>(entity_.data() - text_.data())] = std::byte{'~'};
    ++document_.others[why];
  }

  void look_at(std::string_view code, std::string_view value) {
    constexpr std::string_view kRead[] = {"3DFACE", "POLYLINE", "VERTEX", "SEQEND", "SECTION"};
    constexpr std::string_view kCorners[] = {"71", "72", "73", "74"};
    constexpr int kPolygonMesh = 16;
    if (code == "0" && !among(entity_, kRead)) {
      check_entity();
      ++document_.others[std::string(entity_.substr(0, 40))];
    }
    if (entity_ == "3DFACE" || entity_ == "POLYLINE") {
      if (code == "67" && whole(value) != 0) leave_out("on a sheet (paper space)");
      if (code == "8" && hidden_.contains(upper(value))) leave_out("on a layer that is off or frozen");
    }
    if (code == "70" && entity_ == "POLYLINE" && !left_out_ && (whole(value) & kPolygonMesh) != 0)
      refuse(where_, "polygon meshes (POLYLINE with flag 16)",
             "explode them into faces before exporting, or export STL");
    if (entity_ == "VERTEX" && among(code, kCorners) && value.starts_with('-'))
      document_.bytes[static_cast<std::size_t>(value.data() - text_.data())] = std::byte{' '};
  }

  void check_entity() const {
    constexpr std::string_view kSolids[] = {
        "3DSOLID",     "BODY",         "REGION",          "SURFACE",         "MESH",         "SWEPTSURFACE",
        "NURBSURFACE", "PLANESURFACE", "EXTRUDEDSURFACE", "REVOLVEDSURFACE", "LOFTEDSURFACE"};
    if (entity_ == "INSERT")
      refuse(where_, "blocks that are inserted (INSERT)", "explode them before exporting, or export STL");
    if (among(entity_, kSolids)) refuse(where_, fmt::format("solids ({})", entity_), "export STEP or STL");
  }

  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::string_view section_, entity_, variable_, layer_;
  bool left_out_ = false;         // the entity
  std::set<std::string> hidden_;  // layers, in upper case
  DxfDocument document_;
};

}  // namespace

DxfDocument dxf_document(std::string_view text, const std::string& where) {
  return DxfScanner(text, where).scan();
}

}  // namespace flexel::meshes
