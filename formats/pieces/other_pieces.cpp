// One set of other pieces for the process: what is of the whole is asked for in many functions, few of which know of each other.
#include "formats/pieces/other_pieces.h"

#include <algorithm>
#include <utility>

namespace flexel {
namespace {

OtherPieces* present = nullptr;

template <class Value>
Value summed(Value value) {
  if (present) present->sum(std::span(value.data(), static_cast<std::size_t>(value.size())));
  return value;
}

}  // namespace

OtherPieces* other_pieces() {
  return present;
}

WithOtherPieces::WithOtherPieces(OtherPieces& pieces) {
  present = &pieces;
}

WithOtherPieces::~WithOtherPieces() {
  present = nullptr;
}

WithoutOtherPieces::WithoutOtherPieces() : before_(std::exchange(present, nullptr)) {}

WithoutOtherPieces::~WithoutOtherPieces() {
  present = before_;
}

double over_pieces(double own) {
  if (present) present->sum(std::span(&own, 1));
  return own;
}

Vec3 over_pieces(const Vec3& own) {
  return summed(own);
}

Mat3 over_pieces(const Mat3& own) {
  return summed(own);
}

Box whole_box(const Body& body) {
  return present ? present->box() : bounding_box(body.rest);
}

std::size_t whole_element_count(const Body& body) {
  return present ? present->elements() : body.element_count();
}

std::size_t whole_cell_count(const Body& body) {
  return present ? present->cells() : body.cell_count();
}

bool counts_element(std::uint32_t element) {
  return !present || present->owns_element(element);
}

bool counts_cell(std::uint32_t cell) {
  return !present || present->owns_cell(cell);
}

bool is_surely_under(const Body& body, const CellPoint& at) {
  return !present || is_near(body, at);
}

}  // namespace flexel
