// A rank's piece of a body that no rank has whole (formats/pieces/other_pieces.h), read from its own pieces of a list.
//
// Elements have numbers over all ranks, those that a rank owns (the lowest that has a cell of them) one after another, as the vectors
// of distributed/piece_system.h have. Every function that is no plain question is called by all ranks together.
#pragma once
#include <functional>
#include <memory>

#include "distributed/petsc.h"
#include "formats/pieces/join.h"
#include "formats/pieces/other_pieces.h"

namespace flexel::distributed {

// Calls `own` on every rank. Where it throws InputError or std::bad_alloc on some, all throw, what the first of them told.
void all_or_none(const std::function<void()>& own);

// Rank 0 does `work`, and the others what it orders, until that is done. Of all ranks together.
using LetFirst = std::function<void(const std::function<void()>& work)>;

class SharedBody : public OtherPieces {
 public:
  // As many pieces for each rank: their number is a multiple of ranks(). Throws InputError as join_pieces does, and WholeBodyNeeded
  // for a body that is not one part in one piece of matter, or has been in a run that broke or cut it.
  SharedBody(const PieceFiles& files, LetFirst let_first);
  ~SharedBody() override;
  SharedBody(const SharedBody&) = delete;
  SharedBody& operator=(const SharedBody&) = delete;

  [[nodiscard]] Body& body() { return around_.body; }
  [[nodiscard]] std::uint32_t first_piece() const { return first_; }
  [[nodiscard]] std::uint32_t end_piece() const { return end_; }
  [[nodiscard]] const std::vector<PetscInt>& numbers() const { return number_; }  // (elements)
  [[nodiscard]] PetscInt owned() const { return owned_; }                         // elements
  [[nodiscard]] std::uint32_t first_cell() const {
    return first_cell_;
  }  // number over all ranks of the first own cell

  [[nodiscard]] std::uint32_t own_cells() const {
    return cells_before_[static_cast<std::size_t>(rank()) + 1] - first_cell_;
  }

  // Of elements, by threes: values of own ones into a vector of the system's; what the ranks have at each, summed up; and back.
  void give(const std::vector<Vec3>& values, Vec to) const;
  void give_sum(const std::vector<Vec3>& values, Vec to);
  [[nodiscard]] std::vector<Vec3> take(Vec from);

  void sum(std::span<double> values) override;
  bool take_of_largest(double key, std::span<double> values) override;
  void sum_at_elements(std::vector<Vec3>& values) override;
  void take_from_owners(std::span<double> values, std::size_t width) override;
  std::uint32_t join_sets(std::vector<std::uint32_t>& set) override;
  Vec3 rest_of_corner(std::uint32_t cell, std::uint32_t corner) override;
  std::vector<Bytes> gather(Bytes own) override;
  void let_first(const std::function<void()>& work) override;
  [[nodiscard]] bool is_first() const override { return rank() == 0; }
  [[nodiscard]] std::int64_t number_of(std::uint32_t element) const override { return number_[element]; }
  [[nodiscard]] bool owns_element(std::uint32_t element) const override { return owns_[element] != 0; }
  [[nodiscard]] bool owns_cell(std::uint32_t cell) const override { return around_.ring[cell] == 0; }
  [[nodiscard]] const std::vector<std::uint8_t>& polygons_with_cells() const override { return with_cells_; }
  [[nodiscard]] const std::vector<std::uint8_t>& own_vertices() const override { return own_vertices_; }
  [[nodiscard]] const Box& box() const override { return box_; }
  [[nodiscard]] std::size_t elements() const override { return elements_; }
  [[nodiscard]] std::size_t cells() const override { return cells_; }

 private:
  void choose_own();
  void number_elements();
  void make_vectors();
  void measure();
  void refuse_parts();
  void refuse_fragments();
  void refuse_far_surface();

  LetFirst let_first_;
  std::uint32_t first_ = 0, end_ = 0;  // pieces
  PiecesAround around_;
  std::vector<std::uint8_t> owns_, with_cells_, own_vertices_;  // (elements), (polygons), (vertices)
  std::vector<PetscInt> number_;                                // (elements)
  PetscInt owned_ = 0, first_number_ = 0;
  std::vector<std::uint32_t> cells_before_;  // (ranks + 1) own cells of the ranks before
  std::uint32_t first_cell_ = 0;
  std::size_t elements_ = 0, cells_ = 0;
  Box box_;
  struct Vectors {
    Vector global, local;
    Scatter to_local;
  };
  std::unique_ptr<Vectors> vectors_;
};

}  // namespace flexel::distributed
