// X3D made fit for assimp.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::meshes {

struct X3dDocument {
  Bytes
      bytes;  // the file with a copy in place of each USE, one child in place of each Switch and LOD, and without
              // empty groups
  double unit = 1;         // metres
  std::size_t shapes = 0;  // that it then shows
  std::vector<std::string> left_out;
};

// assimp 5.2 leaves the node that it is in once too often after a group that is used again or empty, and puts all that
// follows elsewhere or nowhere; it makes polygons of long lines, shows what a Switch hides, and takes colours of polygons for
// such of vertices, all in silence. Throws InputError(where, ...): no XML, a USE of what is not there, more copies than
// memory is for, or what cannot be mended here.
[[nodiscard]] X3dDocument x3d_document(const Bytes& bytes, const std::string& where);

}  // namespace flexel::meshes
