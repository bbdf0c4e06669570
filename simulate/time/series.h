// A series of frames: NAME.pvd, which ParaView opens, and beside it NAME_00000.vtu ... The first frame, and those where
// parts have joined, hold the surface; the others say which of them does (SurfaceBeside). The .pvd is rewritten after
// every frame, so that what is there can always be looked at.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

// How far a series has come.
struct SeriesPlace {
  std::vector<double> times;        // s, of its frames
  std::uint64_t surface_frame = 0;  // the last one that holds a surface, and of how many parts
  std::uint64_t surface_parts = 0;
};

class Series {
 public:
  // `path` ends in .pvd. Throws InputError when it does not.
  Series(std::string path, bool compress);
  void add(const Body& body, double time);
  // The frames up to there are there already.
  void resume(const SeriesPlace& place);
  [[nodiscard]] const SeriesPlace& place() const { return place_; }

 private:
  void enter(double time);

  std::string path_, base_, name_, entries_;
  bool compress_;
  SeriesPlace place_;
  std::optional<std::uint64_t> surface_hash_;  // of that frame; nothing: not asked for yet
};

}  // namespace flexel::simulate
