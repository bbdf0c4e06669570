// Positions go where the body's are.
#include "flexel/lammps/imported.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/parallel.h"
#include "base/units.h"
#include "simulate/models/cell_model.h"
#include "simulate/models/paper_model.h"

namespace flexel::lammps {
namespace {

constexpr double kSamePlace = 1e-9;  // of a spacing
constexpr std::size_t kGrain = 1024;

struct Smallest {
  double value = 1;
  Smallest& operator+=(const Smallest& other) {
    value = std::min(value, other.value);
    return *this;
  }
};

// Shapes do not depend on it.
simulate::Material any_material() {
  simulate::Material any;
  any.young = any.density = 1;
  return any;
}

double smallest_volume(const Body& body, const Part& part) {
  const simulate::CellKind kind = simulate::cell_kind(part.lattice, any_material());
  return parallel_sum<Smallest>(
             part.cell_end - part.cell_begin,
             [&](std::size_t i) {
               const std::size_t cell = part.cell_begin + i;
               if (body.broken[cell]) return Smallest{};
               simulate::CellVectors moved;
               for (std::size_t a = 0; a < 8; ++a) {
                 const std::uint32_t e = body.cell_elements[cell][a];
                 moved[a] = body.position[e] - body.rest[e];
               }
               return Smallest{1 + simulate::volume_change(displacement_gradient(kind, moved))};
             },
             kGrain)
      .value;
}

}  // namespace

std::string unsure_origin(const std::string& run, const Body& body, const std::string& where) {
  const auto note = body.notes.find(kRunNote);
  const std::string wanted = note == body.notes.end() ? "" : note->second;
  if (run == wanted) return "";
  if (run.empty())
    return fmt::format("has no column {}, as the script has it: whether it is of this run cannot be told",
                       wanted);
  if (wanted.empty())
    return "is of a run that flexel export wrote, and the body is not the one beside that script: whether it "
           "is of "
           "this run cannot be told";
  throw InputError(
      where,
      "the dump is of another run: give the body that flexel export wrote beside its script, or run "
      "LAMMPS again after an export");
}

void refuse_other_start(const DumpFrame& frame, const Body& body, const std::string& where) {
  double spacing = body.parts.front().lattice.spacing.minCoeff();
  for (const Part& part : body.parts) spacing = std::min(spacing, part.lattice.spacing.minCoeff());
  for (std::size_t e = 0; e < frame.position.size(); ++e)
    if (const double off = (frame.position[e] - body.position[e]).norm(); off > kSamePlace * spacing)
      throw InputError(
          where,
          fmt::format("atom {} begins {} from element {} of the body: the dump is of another run; give "
                      "the body that flexel export wrote beside the script",
                      e + 1, human_length(off), e));
}

void take_frame(const DumpFrame& frame, Body& body) {
  body.position = frame.position;
  body.notes.erase(kRunNote);  // what goes on from here is another run
  body.element_columns.erase("velocity");
  if (frame.velocity.empty()) return;
  Column velocity;
  velocity.components = 3;
  for (const Vec3& each : frame.velocity)
    velocity.values.insert(velocity.values.end(), each.begin(), each.end());
  body.element_columns["velocity"] = std::move(velocity);
}

bool inside_out(const Body& body) {
  bool centre = false;
  for (const Part& part : body.parts) {
    if (part.placement == Placement::centre)
      centre = true;
    else if (!(smallest_volume(body, part) > 0))
      return true;
  }
  if (!centre) return false;
  const simulate::Problem problem{
      body, std::vector<simulate::Material>(body.parts.size(), any_material()), {}, {}, {}, {}, {}, {}, {}};
  return !(simulate::PaperModel(problem).smallest_volume(simulate::state_of(body)).value > 0);
}

}  // namespace flexel::lammps
