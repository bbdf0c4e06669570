// Which reader a format has.
#include "cad/read/occt.h"

#include <fmt/format.h>

#include <TopoDS_Shape.hxx>

#include "base/error.h"
#include "formats/common/readers.h"

namespace flexel::cad {

CadShape read_shape(const CadReadJob& job, const Warn& warn) {
  if (job.format == "step") return read_step(job, warn);
  if (job.format == "iges") return read_iges(job);
  if (job.format == "brep") return read_brep(job);
  throw InputError(job.where, fmt::format("is in no format of OpenCASCADE's: \"{}\"", job.format));
}

std::string damage_message(const std::string& what) {
  return fmt::format("is damaged: OpenCASCADE says \"{}\"", clean_name(what));
}

}  // namespace flexel::cad
