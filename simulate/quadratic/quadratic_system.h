// A scene's linear equilibrium in model `quadratic`: cells, supports and loads, put together.
#pragma once
#include <memory>

#include "simulate/effects/bonds.h"
#include "simulate/effects/loads.h"
#include "simulate/quadratic/cells/nitsche_bond.h"
#include "simulate/quadratic/cells/nitsche_support.h"
#include "simulate/quadratic/quadratic_multigrid.h"
#include "simulate/scene/scene.h"
#include "simulate/thermal/free_strain.h"

namespace flexel::simulate {

// A [[load]] or [gravity], on the nodes.
struct NodalLoad {
  std::string name;
  std::vector<Vec3> forces;                          // (nodes x 3) N, at rest
  bool couple = false;                               // it was given a torque, or a point where its force acts
  std::unique_ptr<FollowerLoad> follower = nullptr;  // in place of the forces where deflections are large
  bool on_elements = false;

  // N (nodes x 3), added to `sum` where the nodes have gone by `displacement`.
  void add_to(const std::vector<Vec3>& displacement, double share, std::vector<Vec3>& sum) const;
};

// What surrounds a submodel: matter beyond its cut faces, of which the displacement is known (simulate/quadratic/submodel.h).
struct Surroundings {
  VoxelRange box;
  // Nodes on the cut faces.
  std::function<std::vector<std::uint32_t>(const QuadraticNodes&)> cut_nodes;
  // Points of these polygons under which the matter beyond lies.
  std::function<std::vector<FacePoint>(const std::vector<std::uint32_t>&)> beyond;
};

// Stiffness and inertia of what is not matter, of the material's: slivers stay regular.
constexpr double kOutside = 1e-6;

class QuadraticSystem {
 public:
  // Throws InputError: cells that the surface cuts without moments, a support or load under which no matter lies, a
  // [[bond]] of parts that do not touch.
  // Keeps references. `surroundings`: of a submodel. Its loads are shares of those of the whole surface, and supports may
  // lie beyond.
  QuadraticSystem(const Problem& problem, const Scene& scene, const Surroundings* surroundings = nullptr);
  QuadraticSystem(const QuadraticSystem&) = delete;
  QuadraticSystem& operator=(const QuadraticSystem&) = delete;

  // The stiffness with supports, whose penalty is `safety` times the usual one.
  [[nodiscard]] QuadraticOperator stiffness(double safety) const;
  // What a submodel is of; null: the whole.
  [[nodiscard]] const VoxelRange* box() const {
    return cut_.surroundings == nullptr ? nullptr : &cut_.surroundings->box;
  }
  // (cut nodes) ascending, of a submodel; and where they go [m].
  [[nodiscard]] const std::vector<std::uint32_t>& cut_nodes() const { return cut_.nodes; }
  [[nodiscard]] const std::vector<Vec3>& cut_displacement() const { return cut_.displacement; }
  void lead_cut_nodes(std::vector<Vec3> displacement) { cut_.displacement = std::move(displacement); }
  // Points of the selected polygons, beyond the cut faces too.
  [[nodiscard]] std::vector<FacePoint> all_points(const std::vector<std::uint32_t>& polygons) const;
  // What the stiffness has of cells where there is no matter, so that slivers stay regular.
  [[nodiscard]] CellProducts<double> outside() const;
  // (nodes x 3) N: loads and what led faces ask for.
  [[nodiscard]] std::vector<Vec3> right_side(double safety) const;
  // (27 x 3) N: what the free strain makes the nodes of a cell do, in the cell's frame.
  [[nodiscard]] std::span<const double> free_forces(std::size_t cell) const {
    return {free_forces_.data() + cell * kCellUnknowns, heated() ? std::size_t{kCellUnknowns} : 0};
  }
  [[nodiscard]] bool heated() const { return free_.any(); }
  // N, the norm of what it asks of all nodes; 0 where there is none.
  [[nodiscard]] double free_force() const { return free_force_; }
  // At cell coordinates; world frame at rest.
  [[nodiscard]] Mat3 free_strain(std::size_t cell, const Vec3& at) const {
    return heated() ? free_.at(part_[cell], nodes_.cells[cell], at) : Mat3(Mat3::Zero());
  }
  // (nodes x 3) m: each part as its mean free strain makes it, about what holds it; what supports hold stays.
  [[nodiscard]] std::vector<Vec3> free_shape() const;
  // (nodes x 3) m, in prescribed components at this share of the moves; 0 elsewhere.
  [[nodiscard]] std::vector<Vec3> prescribed(double share = 1) const;

  [[nodiscard]] const Problem& problem() const { return problem_; }
  [[nodiscard]] const QuadraticNodes& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<NitscheSupport>& supports() const { return supports_; }
  // Those that a rigid link or a rigid part leads: the motions of their ties have a RigidLink, which is found with the displacement.
  [[nodiscard]] const std::vector<const NitscheSupport*>& linked() const { return linked_; }
  // N, the norm of all loads, on held nodes too, and of what links bear on their nodes with.
  [[nodiscard]] double load_norm() const;
  [[nodiscard]] const std::vector<NodalLoad>& loads() const { return loads_; }
  // Some load follows the shape.
  [[nodiscard]] bool follows() const;
  // The load of some rigid link does.
  [[nodiscard]] bool links_follow() const;
  [[nodiscard]] const Mat9& moduli(std::uint32_t part) const { return moduli_[part]; }
  [[nodiscard]] std::uint32_t part_of(std::size_t cell) const { return part_[cell]; }
  [[nodiscard]] double stiffest(std::size_t cell) const { return stiffest_[part_[cell]]; }  // Pa
  // Whether a cell is of a rigid part.
  [[nodiscard]] bool is_rigid(std::size_t cell) const {
    return !rigidity_.empty() && rigidity_[part_[cell]] != Rigidity::none;
  }
  // Whether that cell of nodes().cells is full of matter.
  [[nodiscard]] bool is_whole(std::size_t cell) const;
  // Of what the stiffness has of a cell: its matter, and a little where there is none.
  [[nodiscard]] Moments stiffness_moments(std::size_t cell) const;
  // Of the cell of that index in nodes().cells.
  [[nodiscard]] Moments moments(std::size_t cell) const;
  [[nodiscard]] const Lattice& lattice(std::size_t cell) const {
    return problem_.body.parts[part_[cell]].lattice;
  }
  // The middle of a cell's matter (cell coordinates); of the voxel where there is none to speak of.
  [[nodiscard]] Vec3 middle(std::size_t cell) const;
  // What supports hold of a cell by its faces.
  [[nodiscard]] const std::vector<SupportIntegrals>& cell_supports(std::size_t cell) const {
    return cell_supports_[cell];
  }
  // (pairs) cells of different parts that are bonded.
  [[nodiscard]] const std::vector<BondedCells>& bonds() const { return bonds_; }
  [[nodiscard]] BondSides bond(std::size_t pair, double safety) const;
  // Who is bonded with whom.
  [[nodiscard]] const std::vector<BondedParts>& bonded_parts() const { return bonded_parts_; }
  // Supports or bonds add to the stiffness of a cell.
  [[nodiscard]] bool is_supported(std::size_t cell) const {
    return !cell_supports_[cell].empty() || !cell_bonds_[cell].empty();
  }
  // The cross stiffness of all bonds; `rotation`: (cells), none: as at rest. Nothing where there are none.
  [[nodiscard]] std::shared_ptr<const CellCouplings> couplings(
      double safety, const std::function<Mat3(std::size_t)>& rotation) const;
  // (pairs) the elements of both cells, ascending.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> bonded_elements() const;
  // What its supports and bonds add to a cell's stiffness, in the frame of a cell that is turned.
  [[nodiscard]] CellMatrix support_stiffness(std::size_t cell, double safety, const Mat3& rotation) const;
  [[nodiscard]] double penalty(std::size_t cell, double safety) const;  // Pa/m, beta
  [[nodiscard]] NitschePoint point(const NitscheSupport& support, const FacePoint& at, double safety,
                                   double share = 1) const;
  // (polygons) Pa, what presses on the surface; kUnknownPressure where a support or another load acts.
  [[nodiscard]] const std::vector<double>& pressure() const { return pressure_; }
  // (elements) 1 where a support selects elements, not a face: what presses on the surface of their cells is not known.
  [[nodiscard]] std::vector<std::uint8_t> held_elements() const;
  // What of the loaded surface bears on no matter, for people.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  // (elements) 2 where a support holds all axes, 1 where it holds some, else 0.
  [[nodiscard]] std::vector<std::uint8_t> tied_elements() const;

 private:
  [[nodiscard]] CellProducts<double> cells(
      const std::function<std::optional<Moments>(std::size_t)>& moments) const;
  // With a little stiffness where there is no matter.
  [[nodiscard]] CellProducts<double> regular_cells() const;
  void require_moments() const;
  void place_supports();
  void place_support(const Tie& tie, const Selected& selected);
  void refuse_on_rigid_parts() const;
  void make_links();
  [[nodiscard]] std::shared_ptr<RigidLink> make_link(const NitscheSupport& support) const;
  void integrate_supports();
  void place_bonds(const Bonds::Parameters& parameters);
  void find_bearing_limits();
  void place_loads(const std::vector<Load>& loads);
  [[nodiscard]] NodalLoad load_on_elements(const Load& load,
                                           const std::vector<std::uint32_t>& elements) const;
  [[nodiscard]] std::unique_ptr<FollowerLoad> follower(const Load& load, const std::vector<FacePoint>& points,
                                                       const std::vector<LoadedPoint>& loaded) const;
  [[nodiscard]] std::vector<Vec3> forces_at(const Load& load, const std::vector<FacePoint>& points,
                                            std::vector<LoadedPoint>& loaded) const;
  void check_area(const Load& load, const std::vector<std::uint32_t>& polygons,
                  const std::vector<FacePoint>& points);
  void add_gravity(const Vec3& acceleration);
  void integrate_free_strain();
  [[nodiscard]] double norm_of_free_forces() const;
  [[nodiscard]] std::vector<std::uint8_t> held() const;

  const Problem& problem_;
  const Scene& scene_;
  QuadraticNodes nodes_;
  std::vector<std::uint32_t> part_;        // (cells)
  std::vector<std::uint32_t> moments_at_;  // (cells) place in the body's moments; kWhole
  std::vector<Mat9> moduli_;               // (parts) Pa, world frame
  std::vector<double> stiffest_;           // (parts) Pa, lambda + 2 mu
  std::vector<Tie> ties_;                  // the scene's, then those of rigid parts
  std::vector<Rigidity> rigidity_;         // (parts); none: no part is rigid
  std::vector<NitscheSupport> supports_;
  std::vector<const NitscheSupport*> linked_;
  std::vector<std::vector<SupportIntegrals>> cell_supports_;  // (cells)
  std::vector<BondedCells> bonds_;
  std::vector<std::vector<std::uint32_t>> cell_bonds_;  // (cells) 2 pair + side
  std::vector<double> bearing_limit_;                   // (cells) Pa/m, of bonded ones
  std::vector<BondedParts> bonded_parts_;
  FreeStrain free_;
  double free_force_ = 0;            // N
  std::vector<double> free_forces_;  // (cells x 81) N; none: no free strain
  std::vector<NodalLoad> loads_;
  std::vector<double> pressure_;  // (polygons)
  std::vector<std::string> warnings_;
  struct Cut {
    const Surroundings* surroundings = nullptr;  // null: the whole
    std::vector<std::uint32_t> nodes;
    std::vector<Vec3> displacement;  // (nodes x 3) m
  } cut_;
};

}  // namespace flexel::simulate
