// What carving and gluing make of a body.
#pragma once
#include <string>

#include "flexel/clay/clay_document.h"

namespace flexel::clay {

// `document.now` is what `document.changes` make of `document.start`, and the displacement that of the elements that are left.
// `base`: as in scene_text. Throws InputError: nothing lies there, nothing is near enough, nothing of a part would be left.
void apply_changes(ClayDocument& document, const std::string& base);

// What the page draws where something was carved: the surface without what lay over it, and walls (flexel/view/pack.h). Throws
// InputError: the part's surface is not closed.
[[nodiscard]] std::string surface_pack(const NumberedBody& body);

}  // namespace flexel::clay
