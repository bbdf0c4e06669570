// A body of which this process holds a piece, and others the rest (distributed/): all run the same functions, in the same order,
// and ask each other for what is of the whole.
//
// The body is one part of one piece of matter. This process has cells of its own, each of one process only, and around them two
// rings of ghosts, cells of others. Functions that sum over a body sum over own cells or elements, then over the pieces.
// Everything here but what only reads is called by all processes together.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/files/files.h"
#include "formats/lattice/body.h"
#include "formats/lattice/locate.h"

namespace flexel {

// Told by all processes: something takes the whole body, which one of them is to hold then.
class WholeBodyNeeded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class OtherPieces {
 public:
  virtual ~OtherPieces() = default;
  virtual void sum(std::span<double> values) = 0;
  // `values` become those of the piece with the largest key, of equal ones the first; whether it is this one.
  virtual bool take_of_largest(double key, std::span<double> values) = 0;
  // (elements of this piece) The sum at each element of what each piece has there.
  virtual void sum_at_elements(std::vector<Vec3>& values) = 0;
  // (elements x width) At elements of others' the values that they have.
  virtual void take_from_owners(std::span<double> values, std::size_t width) = 0;
  // Sets of this piece's elements, (elements) by number, kNoSet in none, as sets of the whole: joined where one element is in a set of
  // two pieces. Returned is how many there are over all pieces; `set` becomes their numbers.
  static constexpr std::uint32_t kNoSet = 0xffffffffu;
  virtual std::uint32_t join_sets(std::vector<std::uint32_t>& set) = 0;
  // m: where an element of the cell of a number over all pieces rests.
  virtual Vec3 rest_of_corner(std::uint32_t cell, std::uint32_t corner) = 0;

  // On the first process what each gives, in their order; elsewhere nothing.
  [[nodiscard]] virtual std::vector<Bytes> gather(Bytes own) = 0;
  // The first process does `work`, as one that holds a whole body of its own; the others help where it solves.
  virtual void let_first(const std::function<void()>& work) = 0;

  [[nodiscard]] virtual bool is_first() const = 0;                                // of all processes
  [[nodiscard]] virtual std::int64_t number_of(std::uint32_t element) const = 0;  // over all pieces
  [[nodiscard]] virtual bool owns_element(std::uint32_t element) const = 0;
  [[nodiscard]] virtual bool owns_cell(std::uint32_t cell) const = 0;
  [[nodiscard]] virtual const std::vector<std::uint8_t>& polygons_with_cells()
      const = 0;                                     // (polygons) of any piece
  [[nodiscard]] virtual const Box& box() const = 0;  // m, of the whole body's elements at rest
  [[nodiscard]] virtual std::size_t elements() const = 0;
  [[nodiscard]] virtual std::size_t cells() const = 0;
  // (vertices of the surface) 1: a cell of this piece's own carries it
  [[nodiscard]] virtual const std::vector<std::uint8_t>& own_vertices() const = 0;
};

// Null: this process holds the whole body.
[[nodiscard]] OtherPieces* other_pieces();

// While one lives, other_pieces() is this.
class WithOtherPieces {
 public:
  explicit WithOtherPieces(OtherPieces& pieces);
  ~WithOtherPieces();
  WithOtherPieces(const WithOtherPieces&) = delete;
  WithOtherPieces& operator=(const WithOtherPieces&) = delete;
};

// While one lives, other_pieces() is null.
class WithoutOtherPieces {
 public:
  WithoutOtherPieces();
  ~WithoutOtherPieces();
  WithoutOtherPieces(const WithoutOtherPieces&) = delete;
  WithoutOtherPieces& operator=(const WithoutOtherPieces&) = delete;

 private:
  OtherPieces* before_;
};

// Sums over the pieces; the value itself where there is one.
[[nodiscard]] double over_pieces(double own);
[[nodiscard]] Vec3 over_pieces(const Vec3& own);
[[nodiscard]] Mat3 over_pieces(const Mat3& own);

// Of the whole body: the box around its elements at rest [m], how many there are, and cells.
[[nodiscard]] Box whole_box(const Body& body);
[[nodiscard]] std::size_t whole_element_count(const Body& body);
[[nodiscard]] std::size_t whole_cell_count(const Body& body);
// Whether this process is to count it: its own, or there are no others.
[[nodiscard]] bool counts_element(std::uint32_t element);
[[nodiscard]] bool counts_cell(std::uint32_t cell);

// Whether the cell that a point of the surface was located in is so near to it that no other process has a nearer one: within a
// spacing. Always true where this process holds the whole.
[[nodiscard]] bool is_surely_under(const Body& body, const CellPoint& at);

}  // namespace flexel
