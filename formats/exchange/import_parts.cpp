// A share of the stage for each file.
#include "formats/exchange/import_parts.h"

#include <utility>

#include "base/program/share_scope.h"

namespace flexel {

Surface import_parts(const std::vector<std::string>& paths, const ImportOptions& options,
                     Progress& progress) {
  Surface surface;
  const auto share = [&](std::size_t files) {
    return static_cast<double>(files) / static_cast<double>(paths.size());
  };
  for (std::size_t p = 0; p < paths.size(); ++p) {
    const ShareScope scope(progress, share(p), share(p + 1));
    Surface next = import_surface(paths[p], options);
    if (p == 0)
      surface = std::move(next);
    else
      append(surface, std::move(next));
  }
  return surface;
}

}  // namespace flexel
