// Labels with the numbers of the faces.
#pragma once
#include <string>
#include <vector>

#include "flexel/picture/panel.h"

namespace flexel::picture {

// What stands on each face of the subject's surface: its number as in `flexel info`, with the part's name
// where there are several parts ("knob/3").
[[nodiscard]] std::vector<std::string> face_texts(const Surface& surface);

// Writes the texts of `panel` on the faces that the camera sees, each where the face is widest in the
// picture, as far as they have room there without covering one another. Sets shown[f] of the faces that got
// theirs.
void label_faces(Image& image, const Viewport& viewport, const Camera& camera, const Panel& panel,
                 const std::vector<std::string>& texts, float size, bool beside,
                 std::vector<std::uint8_t>& shown);

}  // namespace flexel::picture
