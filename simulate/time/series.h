// A series of frames: NAME.pvd, which ParaView opens, and beside it NAME_00000.vtu ... The first frame alone
// holds the surface. The .pvd is rewritten after every frame, so that what is there can always be looked at.
#pragma once
#include <string>

#include "formats/lattice/body.h"

namespace flexel::simulate {

class Series {
 public:
  // `path` ends in .pvd. Throws InputError when it does not.
  Series(std::string path, bool compress);
  void add(const Body& body, double time);
  // The frames of these times [s] are there already.
  void resume(const std::vector<double>& times);
  [[nodiscard]] std::size_t size() const { return times_.size(); }
  [[nodiscard]] const std::vector<double>& times() const { return times_; }

 private:
  void enter(double time);

  std::string path_, base_, name_, entries_;
  bool compress_;
  std::vector<double> times_;
  std::size_t parts_ = 0;  // of the last frame
};

}  // namespace flexel::simulate
