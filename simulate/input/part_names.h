// The parts that a scene means by a name: the part of that name, else those in an assembly of the file.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

// Indices, ascending: the part of that name; where there is none, the parts in the assemblies that the name or path means
// ("gearbox", "gearbox/shaft-2", or any run of such names), or the one part at its end. Empty: there is none. `names`
// (parts) and `parts` are of one body; `parts` may be fewer.
[[nodiscard]] std::vector<std::uint32_t> parts_called(const std::vector<std::string>& names,
                                                      const std::vector<SurfacePart>& parts,
                                                      const std::string& name);
[[nodiscard]] std::vector<std::uint32_t> parts_called(const Body& body, const std::string& name);

// Those in assemblies alone, whether or not a part has the name.
[[nodiscard]] std::vector<std::uint32_t> parts_at(const std::vector<SurfacePart>& parts,
                                                  const std::string& path);

[[nodiscard]] std::vector<std::string> part_names(const Body& body);

// By how many parts an entry for `parts`, which `name` means, is for; 0: it is a part's own. Narrower entries go before
// wider ones.
[[nodiscard]] std::size_t entry_width(const std::vector<std::string>& names,
                                      const std::vector<std::uint32_t>& parts, const std::string& name);

// parts_called(), one part at least. Throws InputError(origin, "the body has no part ...").
[[nodiscard]] std::vector<std::uint32_t> require_parts(const Body& body, const std::string& name,
                                                       const std::string& origin);

// The one part. Throws InputError(origin, ...): there is none, or there are several.
[[nodiscard]] std::uint32_t require_part(const Body& body, const std::string& name,
                                         const std::string& origin);

}  // namespace flexel::simulate
