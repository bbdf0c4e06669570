// AMF made fit for assimp.
#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::meshes {

struct AmfDocument {
  struct Use {
    std::string object;         // its id
    Eigen::Matrix4d transform;  // lengths in the file's unit
  };
  Bytes bytes;            // the file without its constellations: every object once, where it was made
  std::vector<Use> uses;  // what the file shows
  std::map<std::string, std::string> names;  // of objects, by id
};

// assimp 5.2 takes the rotations of an instance for displacements. Throws InputError(where, ...): no XML, an instance of
// what is not there, or more instances than memory is for.
[[nodiscard]] AmfDocument amf_document(const Bytes& bytes, const std::string& where);

}  // namespace flexel::meshes
