// What a picture shows, and how.
#pragma once
#include <optional>
#include <string>
#include <utility>

#include "flexel/picture/render/camera.h"
#include "formats/lattice/body.h"

namespace flexel::picture {

// One panel: a surface, or a body (whose own surface is drawn).
struct PictureSubject {
  std::string label;  // the file's name
  std::string where;  // the same for messages, as given
  Surface surface;    // without a body
  std::optional<Body> body;
};

struct PictureOptions {
  int width = 1600, height = 1200;
  std::optional<View> view;  // else chosen; its `up` is the one below
  Up up = Up::z;
  enum class Show { surface, cells, elements } show = Show::surface;  // cells and elements: bodies only
  // "none"; or an attribute; else displacement for bodies that are deformed, and none
  std::optional<std::string> colour;
  // As written: numbers with units. Default: the range of the values
  std::optional<std::pair<std::string, std::string>> range;
  std::optional<double> exaggeration = 1;  // of the displacement; nothing: as chosen for it to be seen
  bool outline_at_rest = true;
  bool faces = false;  // the numbers of the faces on them, from four sides where no view is given
};

}  // namespace flexel::picture
