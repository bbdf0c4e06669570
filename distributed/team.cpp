// A broadcast names what comes next. Solvers are a stack: the search on a coarser lattice that a run may start from ends before
// its own.
#include "distributed/team.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <thread>
#include <vector>

#include "base/files/packing.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "distributed/newton_snes.h"
#include "distributed/petsc.h"
#include "distributed/refusals.h"

namespace flexel::distributed {
namespace {

using simulate::BlockMatrix;
using simulate::LoadStepSolver;
using simulate::Mechanics;
using simulate::NewtonOptions;
using simulate::NewtonOutcome;
using simulate::NewtonProgress;
using simulate::Scene;
using simulate::State;

enum class Order : std::uint8_t { threads, scene, begin, solve, stable, drop, uses, end };

bool at_work = false;
double most_cells = 0;  // of a piece of this rank

// On all ranks; on rank 0 those of all.
std::vector<RankUse> gather_uses() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  constexpr double kUnit = 1024;  // bytes, of ru_maxrss
  const RankUse own{most_cells, kUnit * static_cast<double>(usage.ru_maxrss)};
  std::vector<RankUse> all(rank() == 0 ? static_cast<std::size_t>(ranks()) : 0);
  ok(MPI_Gather(&own, 2, MPI_DOUBLE, all.data(), 2, MPI_DOUBLE, 0, PETSC_COMM_WORLD));
  return all;
}

class AtWork {
 public:
  AtWork() { at_work = true; }
  ~AtWork() {
    if (std::uncaught_exceptions() == entered_) at_work = false;
  }
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;

 private:
  int entered_ = std::uncaught_exceptions();
};

void order(Order what, const Bytes& more = {}) {
  Bytes bytes{static_cast<std::byte>(what)};
  bytes.insert(bytes.end(), more.begin(), more.end());
  broadcast(bytes);
}

Bytes bytes_of(NewtonOptions& options) {
  Packer packer;
  visit_all(packer, options.steps, options.tolerance, options.max_iterations, options.least_scale,
            options.farthest_reach);
  return std::move(packer.bytes);
}

NewtonOptions options_of(std::span<const std::byte> bytes) {
  NewtonOptions options;
  Unpacker unpacker(bytes, "the message of a load step", "is damaged");
  visit_all(unpacker, options.steps, options.tolerance, options.max_iterations, options.least_scale,
            options.farthest_reach);
  return options;
}

// What every rank has of a solver. `mine`: numbers of the elements that rank 0 gives and takes values of; elsewhere none.
class Member {
 public:
  Member(Piece piece, const Scene& scene, const std::vector<PetscInt>& mine)
      : cells_(piece.body.cell_count()), system_(std::move(piece), scene), newton_(system_) {
    most_cells = std::max(most_cells, static_cast<double>(cells_));
    const auto count = static_cast<PetscInt>(mine.size());
    Indices blocks;
    ok(ISCreateBlock(PETSC_COMM_SELF, 3, count, mine.data(), PETSC_COPY_VALUES, blocks.fill()));
    ok(VecCreateSeq(PETSC_COMM_SELF, 3 * count, leader_.fill()));
    for (Vector* each : {&displacement_, &outer_, &prescribed_}) *each = system_.vector();
    ok(VecScatterCreate(displacement_, blocks, leader_, nullptr, to_leader_.fill()));
  }

  // Values of rank 0, by threes, to all, or from all.
  void give(Vec to, const std::vector<double>& values) {
    double* array = nullptr;
    ok(VecGetArray(leader_, &array));
    std::copy(values.begin(), values.end(), array);
    ok(VecRestoreArray(leader_, &array));
    ok(VecScatterBegin(to_leader_, leader_, to, INSERT_VALUES, SCATTER_REVERSE));
    ok(VecScatterEnd(to_leader_, leader_, to, INSERT_VALUES, SCATTER_REVERSE));
  }
  [[nodiscard]] std::vector<double> take(Vec from) {
    ok(VecScatterBegin(to_leader_, from, leader_, INSERT_VALUES, SCATTER_FORWARD));
    ok(VecScatterEnd(to_leader_, from, leader_, INSERT_VALUES, SCATTER_FORWARD));
    PetscInt count = 0;
    const double* array = nullptr;
    ok(VecGetLocalSize(leader_, &count));
    ok(VecGetArrayRead(leader_, &array));
    std::vector<double> values(array, array + count);
    ok(VecRestoreArrayRead(leader_, &array));
    return values;
  }
  NewtonOutcome solve(const NewtonOptions& options, const NewtonProgress* progress,
                      const std::vector<double>& displacement, const std::vector<double>& outer,
                      const std::vector<double>& prescribed) {
    give(displacement_, displacement);
    give(outer_, outer);
    give(prescribed_, prescribed);
    return newton_.solve(displacement_, outer_, prescribed_, options, progress);
  }
  [[nodiscard]] std::vector<double> displacement() { return take(displacement_); }
  [[nodiscard]] std::optional<bool> has_positive_tangent(const std::vector<double>& displacement) {
    give(displacement_, displacement);
    return newton_.has_positive_tangent(displacement_);
  }

 private:
  std::size_t cells_;
  PieceSystem system_;
  NewtonSnes newton_;
  Vector displacement_, outer_, prescribed_, leader_;
  Scatter to_leader_;
};

// Of rank 0.
class LeaderSolver {
 public:
  LeaderSolver(Mechanics& mechanics, const Scene& scene) : mechanics_(mechanics) {
    const Body& body = mechanics.body();
    const State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
    const BlockMatrix added = mechanics.stiffness_of_effects(rest);
    const Partition parts = partition(body, mechanics.cells().active(), ranks());
    const AtWork together;
    order(Order::begin);
    for (int to = 1; to < ranks(); ++to) {
      Piece piece = cut_piece(body, parts, to, mechanics.constraints().mask, added);
      send(to, pack(piece));
    }
    std::vector<PetscInt> numbers;
    for (std::uint32_t e = 0; e < body.element_count(); ++e)
      if (parts.number[e] >= 0) {
        elements_.push_back(e);
        numbers.push_back(parts.number[e]);
      }
    member_ = std::make_unique<Member>(cut_piece(body, parts, 0, mechanics.constraints().mask, added), scene,
                                       numbers);
  }
  ~LeaderSolver() {
    if (at_work)
      (void)member_.release();  // the others are ended, not asked
    else
      order(Order::drop);
  }
  LeaderSolver(const LeaderSolver&) = delete;
  LeaderSolver& operator=(const LeaderSolver&) = delete;

  NewtonOutcome operator()(State& state, const NewtonOptions& options, const NewtonProgress& progress) {
    NewtonOutcome outcome;
    {
      const State rest{std::vector<Vec3>(state.displacement.size(), Vec3::Zero()), state.share};
      std::vector<Vec3> prescribed = state.displacement;
      apply(mechanics_.constraints(), mechanics_.body(), state, prescribed);
      const std::vector<double> outer = values(mechanics_.forces_of_effects(rest));
      const AtWork together;
      NewtonOptions said = options;
      order(Order::solve, bytes_of(said));
      outcome = member_->solve(options, &progress, values(state.displacement), outer, values(prescribed));
      const std::vector<double> found = member_->displacement();
      for (std::size_t i = 0; i < elements_.size(); ++i)
        state.displacement[elements_[i]] = Eigen::Map<const Vec3>(&found[3 * i]);
    }
    check_stop();
    return outcome;
  }
  [[nodiscard]] std::optional<bool> has_positive_tangent(const State& state) {
    const AtWork together;
    order(Order::stable);
    return member_->has_positive_tangent(values(state.displacement));
  }

 private:
  [[nodiscard]] std::vector<double> values(const std::vector<Vec3>& of) const {
    std::vector<double> result(3 * elements_.size());
    for (std::size_t i = 0; i < elements_.size(); ++i)
      std::copy_n(of[elements_[i]].data(), 3, &result[3 * i]);
    return result;
  }

  Mechanics& mechanics_;
  std::vector<std::uint32_t> elements_;  // that have unknowns
  std::unique_ptr<Member> member_;
};

template <class... Values>
Bytes message(Values... values) {
  Packer packer;
  visit_all(packer, values...);
  return std::move(packer.bytes);
}

template <class Value>
Value read_message(std::span<const std::byte> bytes) {
  Unpacker unpacker(bytes, "a message of rank 0", "is damaged");
  Value value;
  visit(unpacker, value);
  return value;
}

class Follower {
 public:
  void obey(Order order, std::span<const std::byte> more) {
    switch (order) {
      case Order::threads:
        limit_.emplace(read_message<int>(more));
        return;
      case Order::scene:
        return take_scene(more);
      case Order::begin:
        members_.push_back(
            std::make_unique<Member>(unpack_piece(receive(0)), scene_, std::vector<PetscInt>()));
        return;
      case Order::solve:
        (void)members_.back()->solve(options_of(more), nullptr, {}, {}, {});
        (void)members_.back()->displacement();
        return;
      case Order::stable:
        return (void)members_.back()->has_positive_tangent({});
      case Order::drop:
        return members_.pop_back();
      case Order::uses:
        return (void)gather_uses();
      case Order::end:
        return;
    }
  }
  // Freeing what all ranks share would wait for them.
  void leave() {
    for (std::unique_ptr<Member>& member : members_) (void)member.release();
  }

 private:
  void take_scene(std::span<const std::byte> more) {
    std::string text, name;
    Unpacker unpacker(more, "the message of a scene", "is damaged");
    visit_all(unpacker, text, name);
    scene_ = simulate::parse_scene(text, name);
  }

  std::optional<ThreadLimit> limit_;
  Scene scene_;
  std::vector<std::unique_ptr<Member>> members_;
};

}  // namespace

void Leader::give_threads(int threads) {
  order(Order::threads, message(threads));
}

void Leader::give(const Scene& scene) {
  scene_ = &scene;
  order(Order::scene, message(scene.text, scene.name));
}

std::vector<RankUse> Leader::uses() const {
  const AtWork together;
  order(Order::uses);
  return gather_uses();
}

void Leader::end(int code) {
  if (at_work) return;
  order(Order::end, message(code));
}

LoadStepSolver Leader::make_solver(Mechanics& mechanics) {
  refuse_unsupported(*scene_, mechanics.effects());
  const std::vector<std::uint8_t>& active = mechanics.cells().active();
  if (std::count(active.begin(), active.end(), 1) < ranks()) return {};
  const auto solver = std::make_shared<LeaderSolver>(mechanics, *scene_);
  return {[solver](State& state, const NewtonOptions& options, const NewtonProgress& progress) {
            return (*solver)(state, options, progress);
          },
          [solver](const State& state) { return solver->has_positive_tangent(state); }};
}

int follow() {
  const StopWaits leader_decides;
  const AtWork together;
  Follower follower;
  try {
    for (;;) {
      Bytes bytes;
      broadcast(bytes);
      const std::span<const std::byte> more = std::span(bytes).subspan(1);
      if (static_cast<Order>(bytes[0]) == Order::end) return read_message<int>(more);
      follower.obey(static_cast<Order>(bytes[0]), more);
    }
  } catch (...) {
    // Where rank 0 failed likewise it says so and ends all.
    std::this_thread::sleep_for(std::chrono::seconds(2));
    follower.leave();
    throw;
  }
}

bool together() {
  return at_work;
}

}  // namespace flexel::distributed
