// `flexel deform` for programs that go on with its result in memory.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/accuracy/accuracy_report.h"
#include "flexel/accuracy/solved_run.h"
#include "mapping/cad_output.h"
#include "mapping/map_part.h"

namespace flexel::commands {

struct Deformed {
  SolvedRun run;                           // its body is deformed
  mapping::MappedPart mapped;              // the part's surface, and where its vertices go
  std::optional<AccuracyReport> accuracy;  // of sizes that were chosen
  std::vector<std::string> lines;          // the answer, as the command says it
  std::string summary;                     // JSON (docs/guide/deform.md)
  std::vector<mapping::CadAnswer> cad;     // STEP, IGES and BREP files that were written
};

// Runs `flexel deform` with these arguments (without its name). -o may be left out. `part` is what stands in for the files of
// the arguments, which then only name it; null: they are read. Throws what the command ends with.
[[nodiscard]] Deformed deform(const std::vector<std::string>& arguments, const Surface* part,
                              Progress::Mode mode);

}  // namespace flexel::commands
