// The contents of one panel of a picture.
#pragma once
#include <memory>
#include <optional>

#include "base/program/progress.h"
#include "flexel/picture/attribute.h"
#include "flexel/picture/picture_options.h"
#include "flexel/picture/render/best_view.h"
#include "flexel/picture/render/drawable.h"
#include "flexel/picture/render/render.h"

namespace flexel::picture {

// The quantity that all panels are coloured by.
struct ColourBy {
  std::string name;      // "" for none
  bool by_rays = false;  // thickness that no attribute gives
};

struct Panel {
  const PictureSubject* subject = nullptr;
  DrawingFrame frame;
  Drawable drawn;
  std::unique_ptr<Tracer> tracer;
  std::optional<Drawable> rest;  // the shape at rest, where it is drawn in outline
  std::unique_ptr<Tracer> rest_tracer;
  Eigen::Matrix3d motion = Eigen::Matrix3d::Zero();
  double largest_displacement = 0, diagonal = 0;  // m
  std::optional<float> low, high;                 // of the values; nothing without any
  std::optional<float> largest;                   // where it is above `high`
};

// What to colour by, when the user did not say or did: displacement where a body is deformed, else nothing.
[[nodiscard]] ColourBy colour_by(const std::vector<PictureSubject>& subjects, const PictureOptions& options);

// A factor that makes the displacement a tenth of the body's size, rounded down to 1, 2, 5 times a power of
// ten; at least 1.
[[nodiscard]] double fitting_exaggeration(const Body& body);

[[nodiscard]] Panel make_panel(const PictureSubject& subject, const PictureOptions& options,
                               const ColourBy& by, Progress& progress);

}  // namespace flexel::picture
