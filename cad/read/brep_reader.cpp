// BREP, OpenCASCADE's own format, text and binary. It carries no unit and no names.
#include <fmt/format.h>

#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BinTools.hxx>
#include <TopoDS_Shape.hxx>
#include <charconv>
#include <ios>
#include <sstream>

#include "base/error.h"
#include "cad/read/occt.h"

namespace flexel::cad {
namespace {

bool is_binary(std::string_view text) {
  constexpr std::string_view kBinary = "Open CASCADE Topology V";
  return text.substr(0, kBinary.size() + 1).find(kBinary) != std::string_view::npos;
}

// OpenCASCADE believes the counts and reads on past the end of a file, so a table that is missing, or longer
// than the file could hold, is refused here.
void check_tables(std::string_view text, const CadReadJob& job) {
  if (text.find("CASCADE Topology V") == std::string_view::npos)
    throw InputError(job.where, "is no BREP file: it names no version of its topology");
  std::size_t at = 0;
  for (const std::string_view table :
       {"Locations ", "Curve2ds ", "Curves ", "Polygon3D ", "PolygonOnTriangulations ", "Surfaces ",
        "Triangulations ", "TShapes "}) {
    const std::string line = fmt::format("\n{}", table);
    at = text.find(line, at);
    if (at == std::string_view::npos)
      throw InputError(job.where, fmt::format("is cut off or damaged: it has no table \"{}\"",
                                              table.substr(0, table.size() - 1)));
    at += line.size();
    std::size_t count = 0;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), count);
    if (error != std::errc{} || count > text.size() - at)
      throw InputError(job.where, fmt::format("is cut off or damaged: its table \"{}\" has a wrong length",
                                              table.substr(0, table.size() - 1)));
  }
  // After the last shape ("*") comes the number of the one that the file is about.
  const std::size_t star = text.rfind('*');
  if (star == std::string_view::npos || star < at ||
      text.find_first_of("0123456789", star) == std::string_view::npos)
    throw InputError(job.where, "is cut off: it does not end with the number of its shape");
}

}  // namespace

CadShape read_brep(const CadReadJob& job) {
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  std::istringstream stream{std::string(text)};  // OpenCASCADE also seeks
  // It reads on past the end without looking, some of it forever; so the stream throws there.
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  TopoDS_Shape shape;
  try {
    if (is_binary(text)) {
      BinTools::Read(shape, stream);
    } else {
      check_tables(text, job);
      BRepTools::Read(shape, stream, BRep_Builder());
    }
  } catch (const std::ios_base::failure&) {
    throw InputError(job.where, "is cut off or damaged: numbers are missing in it");
  }
  if (shape.IsNull()) throw InputError(job.where, "is damaged: OpenCASCADE finds no shape in it");
  const auto nothing = [](const TopoDS_Shape&) { return std::string(); };
  return {std::make_shared<TopoDS_Shape>(shape),
          job.unit,
          {nothing, nothing, nothing, [](const TopoDS_Shape&) { return std::nullopt; }}};
}

}  // namespace flexel::cad
