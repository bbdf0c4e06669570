// The pieces that a fracture broke the parts into.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace flexel::mapping {

enum class CrackMode {
  keep,  // the surface as it is, stretched across cracks
  open,  // parted along the cracks
  cap,   // and closed: pieces are solids
};

// "keep", "open" or "cap"; InputError for any other word, with the nearest.
[[nodiscard]] CrackMode crack_mode(const std::string& name);
[[nodiscard]] std::string name_of(CrackMode mode);

struct CrackPiece {
  std::string name;            // the part's; "bar-2" for the second of its pieces, largest first
  std::uint32_t part = 0;      // of the body
  std::uint32_t fragment = 0;  // index into Components::list
  std::uint32_t elements = 0;
  bool debris = false;       // one element that nothing holds
  bool dropped = false;      // not in the surface
  double volume_before = 0;  // m^3 enclosed at rest; cap only
  double volume_after = 0;   // m^3 once mapped; cap only, 0 when dropped
};

struct CrackReport {
  CrackMode mode = CrackMode::keep;
  std::size_t fragments = 0;           // of parts that are in more than one; 0: nothing broke in two
  std::size_t cracked_parts = 0;       // with cracks that end inside them
  std::size_t spanning_triangles = 0;  // whose corners go with different fragments or sides of a crack
  std::vector<CrackPiece> pieces;      // open and cap, where a part is in more than one
  // Sums over the pieces that are left out.
  [[nodiscard]] std::size_t dropped() const;
  [[nodiscard]] double dropped_volume() const;  // m^3 at rest; cap only
};

// Text lines; none where nothing broke in two.
[[nodiscard]] std::vector<std::string> crack_lines(const CrackReport& report);
// Every key and unit is in docs/reference/cracks.md.
[[nodiscard]] std::string crack_json(const CrackReport& report);

}  // namespace flexel::mapping
