// A series of frames: NAME.pvd, which ParaView opens, and beside it NAME_00000.vtu ... The first frame alone
// holds the surface. The .pvd is rewritten after every frame, so that what is there can always be looked at.
#pragma once
#include <string>

#include "formats/body.h"

namespace flexel {

class Series {
 public:
  // `path` ends in .pvd. Throws InputError when it does not.
  Series(std::string path, bool compress);
  void add(const Body& body, double time);
  [[nodiscard]] std::size_t size() const { return frames_; }

 private:
  std::string path_, base_, name_, entries_;
  bool compress_;
  std::size_t frames_ = 0;
};

}  // namespace flexel
