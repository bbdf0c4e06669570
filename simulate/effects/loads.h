// Loads: a total force spread evenly over the selected surface (or over the volume of the selected elements),
// or a pressure along the surface's normals at rest. Both are dead: they keep the direction and the size that
// they have at rest.
#pragma once
#include "simulate/course.h"
#include "simulate/effects/effect.h"
#include "simulate/selection.h"

namespace flexel {

struct Load {
  Selection where;
  std::optional<Vec3> force;       // N, in total
  std::optional<double> pressure;  // Pa, pushes against the surface
  Course course = {};              // in timed runs; none: all of it from the start
  std::string name;
  std::string origin;  // "beam.toml:12"
};

class Loads {
 public:
  struct Parameters {
    std::vector<Load> loads;
  };
  static constexpr const char* name = "loads";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Loads> make(const Parameters& parameters, const Setting& setting);
  [[nodiscard]] std::string why() const;

  [[nodiscard]] bool constant() const;
  [[nodiscard]] double energy(const State& state) const;
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) const;

 private:
  struct ElementForce {
    std::uint32_t element = 0;
    Vec3 force = Vec3::Zero();  // N
  };
  struct Group {  // loads of one course
    Course course;
    std::vector<ElementForce> forces;  // ascending by element
  };
  struct Total {
    std::string name;
    Vec3 force = Vec3::Zero();  // N
    Course course;
  };
  std::vector<Group> groups_;  // one a load with a course, then all others in one
  std::vector<Total> totals_;  // of each load
};

}  // namespace flexel
