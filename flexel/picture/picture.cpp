// The passes in order: what each panel shows, the range of the colours, the view, the layout; then shaded
// parts, lines over them, words last.
#include "flexel/picture/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/error.h"
#include "base/human.h"
#include "base/program/share_scope.h"
#include "base/stop.h"
#include "flexel/picture/canvas/text.h"
#include "flexel/picture/face_labels.h"
#include "flexel/picture/layout.h"
#include "flexel/picture/panel.h"
#include "flexel/picture/render/lines.h"

namespace flexel::picture {
namespace {

constexpr double kPanels = 0.25, kViewed = 0.3;  // of the time, until it is known what is drawn, from where
constexpr std::uint32_t kPaper = 0xfafbfc, kRestInk = 0x7a8794;

double range_end(const std::string& text, std::optional<Dimension> dimension) {
  try {
    if (dimension) return parse_quantity(text, *dimension);
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    if (std::isfinite(value) && text.find_first_not_of(' ', used) == std::string::npos) return value;
  } catch (const InputError& error) {
    throw InputError(fmt::format("--range: {}", error.what()));
  } catch (const std::exception&) {
  }
  throw InputError(fmt::format("--range: \"{}\" is not a number", text));
}

// The unit may stand at the second number alone: "1:5 mm".
std::pair<double, double> given_range(const std::pair<std::string, std::string>& range,
                                      std::optional<Dimension> dimension) {
  std::string first = range.first;
  const std::size_t unit = range.second.find_last_of("0123456789.");
  if (first.find_last_not_of(" ") == first.find_last_of("0123456789.") && unit != std::string::npos)
    first += range.second.substr(unit + 1);
  const double low = range_end(first, dimension), high = range_end(range.second, dimension);
  if (!(low < high)) throw InputError(fmt::format("--range: {} is not below {}", range.first, range.second));
  return {low, high};
}

// The range of all panels' values. Lengths of vectors begin at zero.
Legend make_legend(const std::vector<Panel>& panels, const ColourBy& by, const PictureOptions& options,
                   std::vector<std::string>& notes) {
  Legend legend;
  legend.title = by.name;
  const std::optional<Dimension> dimension = dimension_of(by.name);
  double low = 0, high = 0, largest = 0;
  bool any = false;
  for (const Panel& panel : panels) {
    if (!panel.low) continue;
    low = any ? std::min<double>(low, *panel.low) : static_cast<double>(*panel.low);
    high = any ? std::max<double>(high, *panel.high) : static_cast<double>(*panel.high);
    const auto most = static_cast<double>(panel.largest.value_or(*panel.high));
    largest = any ? std::max(largest, most) : most;
    any = true;
  }
  if (!any) notes.push_back(fmt::format("no point has a value of \"{}\": everything is grey", by.name));
  legend.smallest = low;
  legend.largest = largest;
  if (low >= 0 && low < 0.5 * high) low = 0;
  if (options.range) std::tie(low, high) = given_range(*options.range, dimension);
  legend.low = low;
  legend.high = high > low ? high : low + std::max(1e-30, 1e-3 * std::abs(low));
  legend.unit = display_unit(dimension, std::max(std::abs(legend.low), std::abs(legend.high)));
  return legend;
}

View choose_view(const std::vector<Panel>& panels, const PictureOptions& options,
                 std::vector<std::string>& notes) {
  if (options.view) return {options.view->azimuth, options.view->elevation, options.up};
  std::vector<ViewSubject> subjects;
  for (const Panel& panel : panels) subjects.push_back({&panel.drawn, panel.tracer.get(), panel.motion});
  const View view = best_view(subjects, static_cast<double>(options.width) / options.height, options.up);
  notes.push_back(fmt::format("view {:g},{:g}", view.azimuth, view.elevation));
  return view;
}

void draw_panel(Image& image, const Panel& panel, const Viewport& viewport, const Camera& camera,
                const ShadeOptions& shade, float scale) {
  // The viewport holds the part exactly; outlines and soft edges need a little more.
  const int spare = 4;
  Viewport room{std::max(0, viewport.x - spare), std::max(0, viewport.y - spare), 0, 0};
  room.width = std::min(image.width, viewport.x + viewport.width + spare) - room.x;
  room.height = std::min(image.height, viewport.y + viewport.height + spare) - room.y;
  constexpr double kRendered = 0.8, kLinesAtRest = 0.9;  // of the time
  {
    const ShareScope rendering(0, kRendered);
    render(image, room, camera, panel.drawn, *panel.tracer, shade);
  }
  check_stop();
  LineStyle style;
  style.scale = scale;
  if (panel.rest) {
    const ShareScope drawing(kRendered, kLinesAtRest);
    const Moved moved{panel.drawn, *panel.tracer};
    LineStyle rest = style;
    rest.ink = colour(kRestInk);
    rest.strength = 0.85f;
    rest.strength_behind = 0.16f;
    rest.scale = 0.8f * scale;
    draw_lines(image, visible_lines(*panel.rest, *panel.rest_tracer, camera, &moved), rest);
  }
  if (panel.drawn.triangles.empty()) return;
  const ShareScope drawing(kLinesAtRest, 1);
  draw_lines(image, visible_lines(panel.drawn, *panel.tracer, camera), style);
}

void hint_at_scale(const std::vector<Panel>& panels, double exaggeration, std::vector<std::string>& notes) {
  double share = 0;
  for (const Panel& panel : panels)
    if (panel.diagonal > 0)
      share = std::max(share, exaggeration * panel.largest_displacement / panel.diagonal);
  if (share > 0 && share < 0.01)
    notes.push_back(
        fmt::format("the displacement is drawn as {} of the part's size: --scale auto makes it visible",
                    human_share(share)));
}

// What the picture has to say of itself, bottom right.
std::vector<std::string> captions(const std::vector<Panel>& panels, double exaggeration) {
  std::vector<std::string> lines;
  const bool moved =
      std::any_of(panels.begin(), panels.end(), [](const Panel& p) { return p.largest_displacement > 0; });
  if (moved && exaggeration != 1)
    lines.push_back(fmt::format("deformation drawn {:g} times as large", exaggeration));
  if (std::any_of(panels.begin(), panels.end(), [](const Panel& p) { return p.rest.has_value(); }))
    lines.emplace_back("grey lines: before");
  return lines;
}

void annotate(Image& image, const std::vector<Panel>& panels, const Layout& layout, const Framing& framing,
              const Legend* legend, double exaggeration) {
  const float size = layout.text;
  if (legend != nullptr) draw_legend(image, layout.legend, size, *legend);
  if (framing.common_view)
    draw_triad(image, 4.2f * size, layout.foot - 0.5f * size, size, framing.cameras.front());
  const float most = 0.2f * static_cast<float>(image.width);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const Viewport& room = layout.panels[p];
    const double pixels = static_cast<double>(framing.cameras[p].pixels) / panels[p].frame.radius;
    const auto left = static_cast<float>(room.x), width = static_cast<float>(room.width);
    if (layout.labels)
      draw_text(image, left + width / 2, static_cast<float>(room.y) - size,
                shortened(panels[p].subject->label, size, width), size, colour(kInk), Anchor::middle);
    if (!framing.common_view)
      draw_triad(image, left + 3 * size, static_cast<float>(room.y + room.height) - 2.5f * size, 0.8f * size,
                 framing.cameras[p]);
    if (!framing.common_scale) {
      draw_scale_bar(image, left, static_cast<float>(room.y + room.height) + 0.2f * size, 0.85f * size,
                     pixels, std::min(most, width / 3));
    } else if (p == 0) {
      draw_scale_bar(image, 9 * size, layout.foot + 0.9f * size, size, pixels, most);
    }
  }
  float y = layout.foot + 0.9f * size;
  const std::vector<std::string> lines = captions(panels, exaggeration);
  for (auto line = lines.rbegin(); line != lines.rend(); ++line, y -= 1.4f * size)
    draw_text(image, static_cast<float>(image.width) - 2.4f * size, y, *line, size, colour(kFaintInk),
              Anchor::right);
}

// Four sides, one from each corner: every face of most parts is seen in one of them.
std::vector<View> four_sides(Up up) {
  return {{45, 30, up}, {225, 30, up}, {135, -30, up}, {315, -30, up}};
}

// The numbers of the faces, and a note of those that got none.
void number_faces(Image& image, const std::vector<Panel>& panels, const Layout& layout,
                  const Framing& framing, std::vector<std::string>& notes) {
  for (std::size_t p = 0; p < panels.size();) {
    const PictureSubject* subject = panels[p].subject;
    const Surface& surface = subject->body ? subject->body->surface : subject->surface;
    const std::vector<std::string> texts = face_texts(surface);
    std::vector<std::uint8_t> shown(texts.size(), 0);
    std::size_t end = p;
    while (end < panels.size() && panels[end].subject == subject) ++end;
    // first which have room on them in some view, so that no other view writes them beside
    Image scratch = image;
    for (const bool beside : {false, true})
      for (std::size_t view = p; view < end; ++view)
        label_faces(beside ? image : scratch, layout.panels[view], framing.cameras[view], panels[view], texts,
                    0.95f * layout.text, beside, shown);
    p = end;
    std::vector<std::string> missing;
    for (std::size_t f = 0; f < texts.size(); ++f)
      if (!shown[f]) missing.push_back(texts[f]);
    const std::size_t count = missing.size();
    if (count == 0) continue;
    if (count > 20) missing.resize(20);
    notes.push_back(
        fmt::format("{} of {} faces are hidden or too small for a number: {}{}; `flexel info` lists them",
                    count, texts.size(), fmt::join(missing, ", "), count > 20 ? ", ..." : ""));
  }
}

// One factor for all panels, so that they can be compared.
double exaggeration_of(const std::vector<PictureSubject>& subjects, const PictureOptions& options) {
  if (options.exaggeration) return *options.exaggeration;
  double factor = 0;
  for (const PictureSubject& subject : subjects)
    if (subject.body && subject.body->position != subject.body->rest) {
      const double fitting = fitting_exaggeration(*subject.body);
      factor = factor > 0 ? std::min(factor, fitting) : fitting;
    }
  return factor > 0 ? factor : 1;
}

std::vector<Panel> make_panels(const std::vector<PictureSubject>& subjects, const PictureOptions& options,
                               const ColourBy& by, std::size_t sides, Progress& progress) {
  std::vector<Panel> panels;
  const std::size_t count = subjects.size() * sides;
  for (const PictureSubject& subject : subjects)
    for (std::size_t side = 0; side < sides; ++side) {
      const double begun = kPanels * static_cast<double>(panels.size()), all = static_cast<double>(count);
      const ShareScope scope(progress, begun / all, (begun + kPanels) / all);
      panels.push_back(make_panel(subject, options, by, progress));
      check_stop();
    }
  return panels;
}

}  // namespace

PictureResult draw_picture(const std::vector<PictureSubject>& subjects, const PictureOptions& given,
                           Progress& progress) {
  if (subjects.empty()) throw InputError("nothing to draw: a picture is of parts or bodies");
  PictureOptions options = given;
  options.exaggeration = exaggeration_of(subjects, given);
  // The fill is a property of cells: on the surface it would be smeared.
  const bool cells = std::all_of(subjects.begin(), subjects.end(),
                                 [](const PictureSubject& s) { return s.body && s.body->cell_count() > 0; });
  if (options.colour == "fill" && options.show == PictureOptions::Show::surface && cells)
    options.show = PictureOptions::Show::cells;
  const ColourBy by = colour_by(subjects, options);
  if (options.range && by.name.empty()) throw InputError("--range needs a --color to be the range of");
  if (options.faces && options.show != PictureOptions::Show::surface)
    throw InputError("--faces numbers the faces of the surface: leave --cells and --elements out");
  std::vector<View> views;
  if (options.faces && !options.view) views = four_sides(options.up);
  std::vector<Panel> panels =
      make_panels(subjects, options, by, std::max<std::size_t>(1, views.size()), progress);
  PictureResult result{Image(options.width, options.height, colour(kPaper)), {}};
  std::optional<Legend> legend;
  if (!by.name.empty()) legend = make_legend(panels, by, options, result.notes);
  hint_at_scale(panels, *options.exaggeration, result.notes);
  const Layout layout = lay_out(panels.size(), options, legend ? &*legend : nullptr);
  if (views.empty()) {
    const ShareScope choosing(progress, kPanels, kViewed, "choosing the view");
    views = {choose_view(panels, options, result.notes)};
  } else {
    const std::vector<View> sides = views;
    for (std::size_t subject = 1; subject < subjects.size(); ++subject)
      views.insert(views.end(), sides.begin(), sides.end());
  }
  const Framing framing = frame_panels(panels, layout, views);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    ShadeOptions shade;
    shade.by_value = !by.name.empty() && !by.by_rays;
    shade.thickness = by.by_rays;
    shade.unit = static_cast<float>(panels[p].frame.radius);
    if (legend) {
      shade.low = static_cast<float>(legend->low);
      shade.high = static_cast<float>(legend->high);
    }
    const auto share = [&](std::size_t drawn) {
      return kViewed + (1 - kViewed) * static_cast<double>(drawn) / static_cast<double>(panels.size());
    };
    const ShareScope drawing(progress, share(p), share(p + 1), "casting rays");
    draw_panel(result.image, panels[p], layout.panels[p], framing.cameras[p], shade, layout.text / 21);
  }
  if (options.faces) number_faces(result.image, panels, layout, framing, result.notes);
  annotate(result.image, panels, layout, framing, legend ? &*legend : nullptr, *options.exaggeration);
  return result;
}

}  // namespace flexel::picture
