// Elements that lie together in memory, for passes over the values of many: a list of elements is mostly runs of
// consecutive ones.
#pragma once
#include <span>

#include "simulate/state/state.h"

namespace flexel::simulate {

struct ElementRun {
  std::uint32_t part = 0, first = 0;   // element
  std::uint32_t place = 0, count = 0;  // in the list
};

// Of an ascending list, those of each part by themselves.
[[nodiscard]] std::vector<ElementRun> element_runs(const std::vector<std::uint32_t>& elements,
                                                   const std::vector<Part>& parts);

// `values` (elements); `listed` (list) like them, those of the list.
void gather(const std::vector<ElementRun>& runs, const std::vector<Vec3>& values, std::vector<Vec3>& listed);
// Whether they are the same bits.
[[nodiscard]] bool same_bits(const std::vector<ElementRun>& runs, const std::vector<Vec3>& values,
                             const std::vector<Vec3>& listed);

// A box of vectors, two at a time.
class WideBox {
 public:
  void add(std::span<const Vec3> values);
  void add_differences(std::span<const Vec3> values, std::span<const Vec3> from);
  [[nodiscard]] Box box() const;

 private:
  using Two = Eigen::Array<double, 6, 1>;
  Two min_ = Two::Constant(1e300), max_ = Two::Constant(-1e300);
};

}  // namespace flexel::simulate
