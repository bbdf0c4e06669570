// Modules are put into one: each after those that it imports, without the lines that import them and the words that export.
// So a page is one file, and names at the top of a module are the only ones of theirs.
#include "flexel/view/page_files.h"

#include <array>
#include <string>

#define FLEXEL_TAKE_IN(name, file) \
  asm(".pushsection .rodata\n"     \
      ".global flexel_page_" name  \
      "\n"                         \
      ".global flexel_page_" name  \
      "_end\n"                     \
      "flexel_page_" name          \
      ":\n"                        \
      ".incbin \"" file            \
      "\"\n"                       \
      "flexel_page_" name          \
      "_end:\n"                    \
      ".popsection\n")
FLEXEL_TAKE_IN("html", FLEXEL_PAGE_FOLDER "page.html");
FLEXEL_TAKE_IN("style", FLEXEL_PAGE_FOLDER "style.css");
FLEXEL_TAKE_IN("licence", FLEXEL_PAGE_FOLDER "three-licence.txt");
FLEXEL_TAKE_IN("three", FLEXEL_THREE_FILE);
FLEXEL_TAKE_IN("unpack", FLEXEL_PAGE_FOLDER "unpack.js");
FLEXEL_TAKE_IN("numbers", FLEXEL_PAGE_FOLDER "numbers.js");
FLEXEL_TAKE_IN("paint", FLEXEL_PAGE_FOLDER "paint.js");
FLEXEL_TAKE_IN("shape", FLEXEL_PAGE_FOLDER "shape.js");
FLEXEL_TAKE_IN("elements", FLEXEL_PAGE_FOLDER "elements.js");
FLEXEL_TAKE_IN("camera", FLEXEL_PAGE_FOLDER "camera.js");
FLEXEL_TAKE_IN("coarse", FLEXEL_PAGE_FOLDER "coarse.js");
FLEXEL_TAKE_IN("smooth", FLEXEL_PAGE_FOLDER "smooth.js");
FLEXEL_TAKE_IN("panel", FLEXEL_PAGE_FOLDER "panel.js");
FLEXEL_TAKE_IN("overlay", FLEXEL_PAGE_FOLDER "overlay.js");
FLEXEL_TAKE_IN("scene", FLEXEL_PAGE_FOLDER "scene.js");
FLEXEL_TAKE_IN("controls", FLEXEL_PAGE_FOLDER "controls.js");
FLEXEL_TAKE_IN("probes", FLEXEL_PAGE_FOLDER "probes.js");
FLEXEL_TAKE_IN("record", FLEXEL_PAGE_FOLDER "record.js");
FLEXEL_TAKE_IN("stream", FLEXEL_PAGE_FOLDER "stream.js");
FLEXEL_TAKE_IN("way", FLEXEL_PAGE_FOLDER "way.js");
FLEXEL_TAKE_IN("clay", FLEXEL_PAGE_FOLDER "clay.js");
FLEXEL_TAKE_IN("main", FLEXEL_PAGE_FOLDER "main.js");

#define FLEXEL_TAKEN(name)                                                                                \
  extern "C" {                                                                                            \
  extern const char flexel_page_##name[];                                                                 \
  extern const char flexel_page_##name##_end[];                                                           \
  }                                                                                                       \
  static std::string_view name##_text() {                                                                 \
    return {flexel_page_##name, static_cast<std::size_t>(flexel_page_##name##_end - flexel_page_##name)}; \
  }
FLEXEL_TAKEN(html)
FLEXEL_TAKEN(style)
FLEXEL_TAKEN(licence)
FLEXEL_TAKEN(three)
FLEXEL_TAKEN(unpack)
FLEXEL_TAKEN(numbers)
FLEXEL_TAKEN(paint)
FLEXEL_TAKEN(shape)
FLEXEL_TAKEN(elements)
FLEXEL_TAKEN(camera)
FLEXEL_TAKEN(coarse)
FLEXEL_TAKEN(smooth)
FLEXEL_TAKEN(panel)
FLEXEL_TAKEN(overlay)
FLEXEL_TAKEN(scene)
FLEXEL_TAKEN(controls)
FLEXEL_TAKEN(probes)
FLEXEL_TAKEN(record)
FLEXEL_TAKEN(stream)
FLEXEL_TAKEN(way)
FLEXEL_TAKEN(clay)
FLEXEL_TAKEN(main)

namespace flexel::view {
namespace {

void append_module(std::string_view text, std::string& script) {
  constexpr std::string_view kImport = "import ", kExport = "export ";
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    if (line.starts_with(kImport)) continue;
    if (line.starts_with(kExport)) line.remove_prefix(kExport.size());
    script += line;
  }
}

}  // namespace

const PageFiles& page_files() {
  static const std::string script = [] {
    std::string all;
    for (const std::string_view text :
         {unpack_text(), numbers_text(), paint_text(), shape_text(), elements_text(), camera_text(),
          coarse_text(), smooth_text(), panel_text(), overlay_text(), scene_text(), probes_text(),
          record_text(), controls_text(), stream_text(), way_text(), clay_text(), main_text()})
      append_module(text, all);
    return all;
  }();
  static const PageFiles files{html_text(), style_text(), three_text(), licence_text(), script};
  return files;
}

}  // namespace flexel::view
