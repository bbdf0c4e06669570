// Cell by cell for model `springs`, connection by connection for model `paper`.
#include "flexel/lammps/springs.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/stop.h"
#include "simulate/models/cells.h"
#include "simulate/models/damping_factors.h"
#include "simulate/models/paper_model.h"
#include "simulate/models/rest_shape.h"

namespace flexel::lammps {
namespace {

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kDirections = half_neighbourhood.size();
constexpr std::size_t kBetweenStops = 4096;

// Which direction of half_neighbourhood a cell's spring from corner a to corner b has, and whether it leads
// from b to a.
struct Direction {
  std::size_t bit = 0;
  bool turned = false;
};

Direction direction_of(std::size_t a, std::size_t b) {
  Index3 step{}, back{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    step[axis] = static_cast<int>(b >> axis & 1) - static_cast<int>(a >> axis & 1);
    back[axis] = -step[axis];
  }
  for (std::size_t bit = 0; bit < kDirections; ++bit) {
    if (half_neighbourhood[bit] == step) return {bit, false};
    if (half_neighbourhood[bit] == back) return {bit, true};
  }
  return {};
}

std::array<Direction, 28> directions() {
  std::array<Direction, 28> all;
  std::size_t next = 0;
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = a + 1; b < 8; ++b) all[next++] = direction_of(a, b);
  return all;
}

// The springs of the cells of a part, added up by element and direction.
class CellSprings {
 public:
  CellSprings(const simulate::Problem& problem, std::uint32_t part, double tau)
      : problem_(problem),
        part_(problem.body.parts[part]),
        tau_(tau),
        kind_(simulate::spring_kind(part_.lattice, problem.materials[part])),
        other_(kDirections * (part_.element_end - part_.element_begin), kNobody),
        sum_(other_.size()) {}

  void add(std::uint32_t cell, const simulate::SpringKind& kind, double share, double damping_factor) {
    const auto& corners = problem_.body.cell_elements[cell];
    for (std::size_t s = 0; s < kind.springs.size(); ++s) {
      const simulate::Spring& spring = kind.springs[s];
      if (!(spring.stiffness > 0)) continue;
      const auto [bit, turned] = directions_[s];
      const std::uint32_t from = corners[turned ? spring.b : spring.a],
                          to = corners[turned ? spring.a : spring.b];
      const std::size_t place = kDirections * (from - part_.element_begin) + bit;
      const Sum held{share, share * spring.flowed, share * damping_factor};
      if (other_[place] == kNobody) other_[place] = to;
      if (other_[place] == to) {
        sum_[place].share += held.share;
        sum_[place].flowed += held.flowed;
        sum_[place].damped += held.damped;
      } else {  // another piece of matter at the same place of the lattice
        apart_.push_back(made(from, to, bit, held));
      }
    }
  }
  [[nodiscard]] const simulate::SpringKind& kind() const { return kind_; }

  void take(std::vector<Spring>& springs) const {
    for (std::uint32_t e = part_.element_begin; e < part_.element_end; ++e)
      for (std::size_t bit = 0; bit < kDirections; ++bit) {
        const std::size_t place = kDirections * (e - part_.element_begin) + bit;
        if (other_[place] != kNobody) springs.push_back(made(e, other_[place], bit, sum_[place]));
      }
    springs.insert(springs.end(), apart_.begin(), apart_.end());
  }

 private:
  struct Sum {  // over the cells
    double share = 0;
    double flowed = 0;  // m
    double damped = 0;
  };
  [[nodiscard]] Spring made(std::uint32_t from, std::uint32_t to, std::size_t bit, const Sum& sum) const {
    const auto s = static_cast<std::size_t>(std::find_if(directions_.begin(), directions_.end(),
                                                         [&](const Direction& d) { return d.bit == bit; }) -
                                            directions_.begin());
    const double stiffness = kind_.springs[s].stiffness;
    return {from, to, stiffness * sum.share, kind_.springs[s].rest.norm() + sum.flowed / sum.share,
            tau_ * stiffness * sum.damped};
  }

  const simulate::Problem& problem_;
  const Part& part_;
  double tau_;
  std::array<Direction, 28> directions_ = directions();
  simulate::SpringKind kind_;
  std::vector<std::uint32_t> other_;  // (elements of the part x 13) the element there; kNobody: no spring
  std::vector<Sum> sum_;
  std::vector<Spring> apart_;
};

void add_cell_springs(const simulate::Problem& problem, std::uint32_t part, double tau,
                      std::vector<Spring>& springs) {
  const Body& body = problem.body;
  const std::vector<std::uint8_t> active = simulate::active_cells(problem);
  const std::vector<double> shares = simulate::stiffness_shares(body),
                            factors = simulate::damping_factors(body);
  const simulate::RestShapes shapes(body);
  CellSprings sum(problem, part, tau);
  for (std::uint32_t cell = body.parts[part].cell_begin; cell < body.parts[part].cell_end; ++cell) {
    if (cell % kBetweenStops == 0) check_stop();
    if (!active[cell]) continue;
    const std::optional<simulate::SpringKind> own = shapes.of(sum.kind(), cell);
    sum.add(cell, own ? *own : sum.kind(), shares[cell], factors.empty() ? 1 : factors[cell]);
  }
  sum.take(springs);
}

void add_connections(const simulate::Problem& problem, const std::vector<double>& damping,
                     std::vector<Spring>& springs) {
  const simulate::PaperModel model(problem);
  const simulate::ConnectionMemory& memory = model.memory();
  for (std::uint32_t e = 0; e < problem.body.element_count(); ++e) {
    if (e % kBetweenStops == 0) check_stop();
    for (const simulate::ConnectionRows::Entry& entry : model.rows().of(e)) {
      const double stiffness = model.stiffness(e, entry);
      if (entry.sign < 0 || !(stiffness > 0)) continue;
      const double flowed = memory.flowed.empty() ? 0 : memory.flowed[model.place(entry)];
      springs.push_back({e, entry.other, stiffness, model.kind(e, entry.kind).length + flowed,
                         damping[model.part_of(e)] * model.damping_factor(entry) * stiffness});
    }
  }
}

}  // namespace

std::vector<Spring> springs_of(const simulate::Problem& problem, const std::vector<double>& damping) {
  std::vector<Spring> springs;
  bool centre = false;
  for (std::uint32_t p = 0; p < problem.body.parts.size(); ++p) {
    if (problem.body.parts[p].placement == Placement::centre)
      centre = true;
    else
      add_cell_springs(problem, p, damping[p], springs);
  }
  if (centre) add_connections(problem, damping, springs);
  return springs;
}

}  // namespace flexel::lammps
