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

enum class Order : std::uint8_t {
  threads,
  scene,
  share,
  begin,
  solve,
  of_state,
  multiply,
  drop,
  back,
  uses,
  end
};
// Of a state, or of the tangent.
enum class Question : std::uint8_t { figures, forces, stable, diagonal };

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

// Of rank 0, while the others wait for its orders.
class AtRest {
 public:
  AtRest() { at_work = false; }
  ~AtRest() { at_work = true; }
  AtRest(const AtRest&) = delete;
  AtRest& operator=(const AtRest&) = delete;
};

void order(Order what, const Bytes& more = {}) {
  Bytes bytes{static_cast<std::byte>(what)};
  bytes.insert(bytes.end(), more.begin(), more.end());
  broadcast(bytes);
}

template <class Archive>
void visit_request(Archive& archive, SharedRequest& request) {
  visit_all(archive, request.files.list, request.files.run, request.files.files, request.output,
            request.failed, request.stress, request.estimate, request.compress, request.threads);
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
  void give_displacement(const std::vector<double>& values) { give(displacement_, values); }
  void give_outer(const std::vector<double>& values) { give(outer_, values); }
  void give_prescribed(const std::vector<double>& values) { give(prescribed_, values); }
  [[nodiscard]] std::vector<double> displacement() { return take(displacement_); }
  [[nodiscard]] std::vector<double> outer() { return take(outer_); }
  NewtonOutcome solve(const NewtonOptions& options, const NewtonProgress* progress) {
    return newton_.solve(displacement_, outer_, prescribed_, options, progress);
  }

  // What is asked of the displacement that was given; values of elements are in outer() then.
  struct Answer {
    simulate::CellsElsewhere::Figures figures;
    std::optional<bool> stable;
  };
  Answer ask(Question question) {
    Answer answer;
    if (question == Question::figures) answer.figures = system_.figures(displacement_);
    if (question == Question::forces) system_.forces(displacement_, outer_, outer_, prescribed_);
    if (question == Question::stable) answer.stable = newton_.has_positive_tangent(displacement_);
    if (question == Question::diagonal) {
      assemble_at_rest();
      system_.diagonal(outer_);
    }
    return answer;
  }
  // The product of the tangent at rest with the displacement that was given, in outer().
  void multiply() {
    assemble_at_rest();
    system_.multiply(displacement_, outer_);
  }

 private:
  void assemble_at_rest() {
    ok(VecZeroEntries(prescribed_));
    system_.assemble(prescribed_, {}, nullptr, nullptr);
  }

  std::size_t cells_;
  PieceSystem system_;
  NewtonSnes newton_;
  Vector displacement_, outer_, prescribed_, leader_;
  Scatter to_leader_;
};

// Of rank 0.
class LeaderSolver : public simulate::CellsElsewhere {
 public:
  LeaderSolver(Mechanics& mechanics, const std::vector<std::uint8_t>& active, const Scene& scene)
      : mechanics_(mechanics) {
    const Body& body = mechanics.body();
    const State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
    const BlockMatrix added = mechanics.stiffness_of_effects(rest);
    const Partition parts = partition(body, active, ranks());
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
  ~LeaderSolver() override {
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
      const AtWork together;
      NewtonOptions said = options;
      order(Order::solve, bytes_of(said));
      give(state);
      outcome = member_->solve(options, &progress);
      const std::vector<double> found = member_->displacement();
      for (std::size_t i = 0; i < elements_.size(); ++i)
        state.displacement[elements_[i]] = Eigen::Map<const Vec3>(&found[3 * i]);
    }
    check_stop();
    return outcome;
  }

  [[nodiscard]] Figures figures(const State& state) override { return ask(Question::figures, state).figures; }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    (void)ask(Question::forces, state);
    add(take_values(), forces);
  }
  [[nodiscard]] std::optional<bool> has_positive_tangent(const State& state) override {
    return ask(Question::stable, state).stable;
  }
  [[nodiscard]] std::vector<Vec3> diagonal() override {
    std::vector<Vec3> all(mechanics_.body().element_count(), Vec3::Zero());
    (void)ask(Question::diagonal, {all, 1});
    add(take_values(), all);
    return all;
  }
  void multiply(const std::vector<Vec3>& x, std::vector<Vec3>& y) override {
    {
      const AtWork together;
      order(Order::multiply);
      member_->give_displacement(values(x));
      member_->multiply();
      answer_ = member_->outer();
    }
    std::fill(y.begin(), y.end(), Vec3::Zero());
    add(take_values(), y);
  }

 private:
  // One by one: each takes as much room as the displacements.
  void give(const State& state) {
    member_->give_displacement(values(state.displacement));
    {
      std::vector<Vec3> prescribed = state.displacement;
      apply(mechanics_.constraints(), mechanics_.body(), state, prescribed);
      member_->give_prescribed(values(prescribed));
    }
    const State rest{std::vector<Vec3>(state.displacement.size(), Vec3::Zero()), state.share};
    member_->give_outer(values(mechanics_.forces_of_effects(rest)));
  }
  Member::Answer ask(Question question, const State& state) {
    const AtWork together;
    order(Order::of_state, {static_cast<std::byte>(question)});
    member_->give_displacement(values(state.displacement));
    const Member::Answer answer = member_->ask(question);
    answer_ = member_->outer();
    return answer;
  }
  [[nodiscard]] std::vector<double> take_values() { return std::exchange(answer_, {}); }
  void add(const std::vector<double>& values, std::vector<Vec3>& to) const {
    for (std::size_t i = 0; i < elements_.size(); ++i)
      to[elements_[i]] += Eigen::Map<const Vec3>(&values[3 * i]);
  }
  [[nodiscard]] std::vector<double> values(const std::vector<Vec3>& of) const {
    std::vector<double> result(3 * elements_.size());
    for (std::size_t i = 0; i < elements_.size(); ++i)
      std::copy_n(of[elements_[i]].data(), 3, &result[3 * i]);
    return result;
  }

  Mechanics& mechanics_;
  std::vector<std::uint32_t> elements_;  // that have unknowns
  std::unique_ptr<Member> member_;
  std::vector<double> answer_;  // of the last question, values of `elements_`
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
      case Order::share:
        return share(more);
      case Order::begin:
        members_.push_back(
            std::make_unique<Member>(unpack_piece(receive(0)), scene_, std::vector<PetscInt>()));
        return;
      case Order::solve:
        return solve(*members_.back(), options_of(more));
      case Order::of_state:
        members_.back()->give_displacement({});
        (void)members_.back()->ask(static_cast<Question>(more[0]));
        return (void)members_.back()->outer();
      case Order::multiply:
        members_.back()->give_displacement({});
        members_.back()->multiply();
        return (void)members_.back()->outer();
      case Order::drop:
        return members_.pop_back();
      case Order::uses:
        return (void)gather_uses();
      case Order::back:
      case Order::end:
        return;
    }
  }
  // Obeys until this order, of which what it says is returned.
  Bytes obey_until(Order last) {
    for (;;) {
      Bytes bytes;
      broadcast(bytes);
      if (static_cast<Order>(bytes[0]) == last) return {bytes.begin() + 1, bytes.end()};
      obey(static_cast<Order>(bytes[0]), std::span(bytes).subspan(1));
    }
  }
  // Freeing what all ranks share would wait for them.
  void leave() {
    for (std::unique_ptr<Member>& member : members_) (void)member.release();
  }

 private:
  static void solve(Member& member, const NewtonOptions& options) {
    member.give_displacement({});
    member.give_prescribed({});
    member.give_outer({});
    (void)member.solve(options, nullptr);
    (void)member.displacement();
  }
  // All know where it takes the whole body: the leader goes on with that.
  void share(std::span<const std::byte> more) {
    Unpacker unpacker(more, "the message of a run", "is damaged");
    SharedRequest request;
    visit_request(unpacker, request);
    Progress silent("", Progress::Mode::silent);
    try {
      const WholeBodies whole{{}, [this](const auto&) { (void)obey_until(Order::back); }};
      most_cells = static_cast<double>(run_on_pieces(request, scene_, {}, whole, silent, {}));
    } catch (const WholeBodyNeeded&) {
    }
  }
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

std::string Leader::run(const SharedRequest& request, const simulate::SimulateOptions& options,
                        Progress& progress, const TellResult& tell) {
  const AtWork together;
  Packer packer;
  SharedRequest said = request;
  visit_request(packer, said);
  order(Order::share, packer.bytes);
  try {
    const WholeBodies whole{[this](Mechanics& mechanics) { return make_solver(mechanics); },
                            [](const std::function<void()>& work) {
                              const AtRest resting;
                              work();
                              order(Order::back);
                            }};
    most_cells = static_cast<double>(run_on_pieces(request, *scene_, options, whole, progress, tell));
  } catch (const WholeBodyNeeded& needed) {
    return needed.what();
  }
  return "";
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
  const std::vector<std::uint8_t> active = mechanics.active();
  if (std::count(active.begin(), active.end(), 1) < ranks()) return {};
  const auto solver = std::make_shared<LeaderSolver>(mechanics, active, *scene_);
  mechanics.move_cells(solver);
  return [solver](State& state, const NewtonOptions& options, const NewtonProgress& progress) {
    return (*solver)(state, options, progress);
  };
}

int follow() {
  const StopWaits leader_decides;
  const AtWork together;
  Follower follower;
  try {
    return read_message<int>(follower.obey_until(Order::end));
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
