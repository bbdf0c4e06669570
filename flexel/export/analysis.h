// A scene on a mesh in the terms of finite element programs: held degrees of freedom, linear equations
// between them, nodal forces, gravity, tied surfaces. No file format.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flexel/export/mesh.h"
#include "simulate/scene/scene.h"

namespace flexel::mesh_export {

struct HeldAxis {  // one displacement component of a node
  std::uint32_t node = 0;
  std::uint8_t axis = 0;
  double value = 0;  // m
};

// first_factor * u(first) + second_factor * u(second) = value [m], along one world axis.
struct NodeEquation {
  std::uint32_t first = 0, second = 0;  // `first` is the one that is eliminated
  double first_factor = 1, second_factor = 0;
  std::uint8_t axis = 0;
  double value = 0;
};

struct AnalysisSupport {  // one [[fix]] or [[move]]
  std::string name;
  bool is_move = false;
  std::vector<std::uint32_t> nodes;  // that it holds, ascending
  std::vector<HeldAxis> held;
  std::vector<NodeEquation> equations;  // where the surface passes between nodes
};

struct AnalysisLoad {  // one [[load]]
  std::string name, kind;
  std::vector<std::pair<std::uint32_t, Vec3>> forces;  // N, ascending by node
  Vec3 total = Vec3::Zero();                           // N
};

struct TiedFaces {                                  // two parts that touch
  std::array<std::uint32_t, 2> part{};              // of the finer mesh first
  std::array<std::vector<std::uint32_t>, 2> faces;  // of body.surface, that touch
  double tolerance = 0;                             // m, gap within which nodes are tied
};

struct AnalysisProbe {
  std::string name;
  std::vector<std::pair<std::uint32_t, double>> weights;  // of the nodes in the mean; sum 1
  double distance = 0;                                    // m, of a tetrahedron's node from the point
};

struct Analysis {
  AnalysisMesh mesh;
  std::vector<simulate::Material> materials;  // (parts)
  std::vector<AnalysisSupport> supports;
  std::vector<AnalysisLoad> loads;
  std::optional<Vec3> gravity;  // m/s^2
  std::vector<TiedFaces> ties;
  std::vector<AnalysisProbe> probes;
  bool large_deflection = false;
  std::string why_deflection;  // the reason for it
  int load_steps = 1;
  std::vector<std::string> warnings;  // what is not, or not exactly, as in the scene
};

}  // namespace flexel::mesh_export
