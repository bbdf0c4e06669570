// One file as the page shows it: a part, a body, or a series of bodies.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/program/progress.h"
#include "flexel/view/shape.h"
#include "formats/lattice/body.h"

namespace flexel::view {

// What is to be shown: a surface, a body, or a series.
struct ViewSubject {
  std::string label;  // the file's name
  std::string where;  // the same for messages, as given
  Surface surface;    // without a body
  std::optional<Body> body;
  std::string series;  // path of a .pvd, in place of a body
};

// One value a point for each frame; SI, NaN where nothing is known. Named as an attribute of flexel picture.
struct Field {
  std::string name;
  std::vector<std::vector<double>> values;  // (frames)(points)
  std::optional<double> largest;            // of the matter, as the summary gives it; of one state only
};

struct Drawn {
  Shape shape;
  std::vector<std::vector<Vec3>> displacement;  // (frames)(points x 3) m; none where nothing moved
  std::vector<Field> fields;
  std::vector<std::uint8_t> colours;  // (points x 3) the file's own, sRGB; or none
  // (points x 8) elements that carry each point, and their weights; or none: it moves as its frames say
  std::vector<std::uint32_t> carriers = {};
  std::vector<double> weights = {};
};

struct ViewFile {
  std::string label;
  std::vector<std::string> parts;
  std::vector<SurfaceFace> faces;
  std::vector<std::uint32_t> face_numbers;  // within their parts, from 1
  std::optional<Drawn> surface, lattice;
  std::vector<double> times;  // s, of the frames of a series
  std::vector<std::pair<std::string, std::string>>
      facts;  // a name and what is known: counts, notes of the body
};

struct ViewOptions {
  bool cells = false;       // the lattice too
  std::string colour = {};  // an attribute that is needed; "" for those that there are
};

struct NoSuchAttribute : InputError {
  using InputError::InputError;
};

// The surface of a body, to be moved by its elements while it is looked at: Drawn::carriers.
[[nodiscard]] ViewFile make_live_file(const Body& body, const std::string& label);

// Throws NoSuchAttribute; InputError: a body that has neither a surface nor cells, a frame that cannot be read, positions that are not finite.
[[nodiscard]] ViewFile make_view_file(const ViewSubject& subject, const ViewOptions& options,
                                      Progress& progress);

}  // namespace flexel::view
