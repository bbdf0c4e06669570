// Mutated dumps of LAMMPS, taken into a body frame by frame.
#include "flexel/lammps/dump.h"
#include "flexel/lammps/imported.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/small_body.h"

namespace {

using namespace flexel;

std::string frame(const Body& body, int step, const std::string& more, const std::string& values) {
  std::string text = "ITEM: UNITS\nsi\nITEM: TIME\n0.5\nITEM: TIMESTEP\n" + std::to_string(step) +
                     "\nITEM: NUMBER OF ATOMS\n" + std::to_string(body.element_count()) +
                     "\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z" + more + "\n";
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    text += std::to_string(e + 1);
    for (const double x : body.position[e]) text += " " + std::to_string(x);
    text += values + "\n";
  }
  return text;
}

void read_dump(const std::string& path) {
  Body body = fuzz::small_body();
  lammps::DumpReader reader(path, body.element_count());
  while (const std::optional<lammps::DumpFrame> next = reader.next()) {
    (void)lammps::unsure_origin(reader.run(), body, path);
    if (next->step == 0) lammps::refuse_other_start(*next, body, path);
    lammps::take_frame(*next, body);
    (void)lammps::inside_out(body);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Body body = fuzz::small_body();
  const std::string with = frame(body, 7, " vx vy vz v_flexel0123456789abcdef", " 1 -2e-3 3.5 0");
  return fuzz::run(argc, argv, "fuzz_dump",
                   {fuzz::bytes_of(with), fuzz::bytes_of(frame(body, 7, "", "") + frame(body, 9, "", "")),
                    fuzz::bytes_of(frame(body, 0, "", ""))},
                   read_dump);
}
