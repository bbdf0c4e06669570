#include "voxelize/align.h"

#include <algorithm>
#include <cmath>

namespace flexel {

Lattice align_lattice(const PartMesh& mesh, double size, Align align, bool cubic) {
  const Box box = bounding_box(mesh.world);
  Lattice lattice{.origin = box.min, .spacing = Vec3::Constant(size)};
  if (align == Align::none || cubic) return lattice;
  for (int a = 0; a < 3; ++a) {
    const double cells = std::max(1., std::round(box.size()[a] / size));
    if (box.size()[a] > 0) lattice.spacing[a] = box.size()[a] / cells;
  }
  return lattice;
}

}  // namespace flexel
