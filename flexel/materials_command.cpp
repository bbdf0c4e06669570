// flexel materials: the library of materials.
#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/arguments.h"
#include "flexel/commands.h"
#include "flexel/measure/materials_table.h"

namespace flexel::commands {

int materials_command(int argc, char** argv) {
  bool json = false, markdown = false, words = false;
  CommandLine app{"Lists the materials that scenes and --material know, each figure with its source.",
                  "flexel materials"};
  const Option as_json = app.add_flag("--json", json, "As JSON, in SI units");
  const Option as_page = app.add_flag("--markdown", markdown, "As a table in Markdown").excludes(as_json);
  app.add_flag("--words", words, "The names alone, a line each, for completion")
      .excludes(as_json)
      .excludes(as_page);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  OutputFile out("-", false);
  out.write(json       ? materials_json()
            : markdown ? materials_markdown()
            : words    ? materials_words()
                       : materials_text());
  out.commit();
  return kExitDone;
}

}  // namespace flexel::commands
