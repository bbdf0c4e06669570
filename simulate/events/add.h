// add: a body from a file joins the scene, where and as fast as the file says. docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

class Add {
 public:
  static constexpr const char* name = "add";
  [[nodiscard]] static Add parse(TableReader& reader);
  // Reads the file: the names of its parts. Throws InputError.
  [[nodiscard]] std::vector<std::string> prepare();
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  std::string path_, origin_;
  std::optional<Vec3> velocity_;  // m/s, in place of that of the file
  Body body_;
};

}  // namespace flexel::simulate
