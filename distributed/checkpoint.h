// The last load step that ended in equilibrium, in a file, so that a job that was killed goes on from there.
//
// The file: eight bytes "flexelLS", the version and a content hash [u64, little endian] of what follows: the fingerprints of scene
// and body, the share of the load, the reach of the first linear answer [m], the relative residual, whether the part has buckled (a byte), the
// displacements [m], lists after their length.
#pragma once
#include <optional>
#include <string>

#include "simulate/equilibrium/equilibrium.h"

namespace flexel::distributed {

class LoadStepFile {
 public:
  // Of a run of this scene on this body.
  LoadStepFile(const simulate::Scene& scene, const Body& body);

  // Appears under `path` only when it is whole. Throws InputError: it cannot be written.
  void write(const simulate::LoadStepDone& done, const std::string& path) const;
  // Throws InputError: no such file, truncated, damaged, of another scene or body.
  [[nodiscard]] simulate::LoadStepDone read(const std::string& path) const;

 private:
  std::uint64_t scene_ = 0, body_ = 0;
};

}  // namespace flexel::distributed
