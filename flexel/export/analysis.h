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

// Throws InputError naming what of the scene has no translation: a timed run, events, effects other than
// gravity, loads, fixes, moves and bonds. `problem` is that of a lattice of the part.
void refuse_untranslatable(const simulate::Scene& scene, const simulate::Problem& problem);

// Models other than `cells` are dropped from the scene's parts; a line for each.
[[nodiscard]] std::vector<std::string> drop_models(simulate::Scene& scene);

// Translates a scene that refuse_untranslatable() let pass. `problem` is that of the mesh's body. What
// differs from the scene is added to the warnings. Throws InputError: selections that select nothing.
[[nodiscard]] Analysis translate(AnalysisMesh mesh, const simulate::Scene& scene,
                                 const simulate::Problem& problem);

// What is held already: (node, axis) -> value [m]; not a number where an equation gives it.
using HeldValues = std::map<std::pair<std::uint32_t, std::uint8_t>, double>;

// A fix or a move as held nodes, and equations where the surface cuts through hexahedra. Degrees of freedom
// that are held already stay so; `shared` counts those that this support wanted elsewhere. Throws InputError:
// no node lies under the selected surface.
[[nodiscard]] AnalysisSupport hold(const simulate::Tie& tie, const AnalysisMesh& mesh,
                                   const simulate::Problem& problem, HeldValues& taken, std::size_t& shared);

// The forces [N] (nodes) of a load on the mesh, consistent with the elements' shape functions.
[[nodiscard]] std::vector<Vec3> nodal_forces(const simulate::Load& load, const AnalysisMesh& mesh,
                                             const simulate::Problem& problem);

// The mean over a selection, or a point, in terms of nodes. Hexahedra: as in a Flexel run. Tetrahedra: the
// mean over the area of the selected faces, and of a point its nearest node. Throws InputError: nothing
// there.
[[nodiscard]] AnalysisProbe place_probe(const simulate::Probe& probe, const AnalysisMesh& mesh,
                                        const simulate::Problem& problem);

// CAD faces of different parts that lie on one another, within `tolerance` [m], facing each other.
[[nodiscard]] std::vector<TiedFaces> touching_faces(const AnalysisMesh& mesh, double tolerance);

// Whether a geometrically linear analysis would change the largest displacement by over a percent: from a
// coarse lattice under the scene's loads and under a thousandth of them. `why`: the reason, or why it is not
// known.
[[nodiscard]] bool large_deflection(const Surface& surface, simulate::Scene scene, int threads,
                                    std::string& why);

}  // namespace flexel::mesh_export
