// Prints the errors of the central-spring models for the paper's cantilever as a table (docs/measurements/accuracy.md).
#include <fmt/format.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/simulate/study_beam.h"

namespace {

using namespace flexel;
using namespace flexel::simulate;

struct Row {
  const char* name;
  std::function<double(int)> error;
};

}  // namespace

int main() {
  const std::vector<int> through{2, 3, 4, 6, 8, 12, 16};
  const std::vector<Row> rows = {
      {"`paper`, hooke = \"paper\" (k = E l)", [](int n) { return testing::paper_error(n, "paper"); }},
      {"`paper`, hooke = \"ganovelli\"", [](int n) { return testing::paper_error(n, "ganovelli"); }},
      {"`springs`", testing::springs_error},
      {"`cells`", testing::cells_error}};
  std::string head = "| tip error in %, n = |", rule = "|---|";
  for (const int n : through) {
    head += fmt::format(" {} |", n);
    rule += "---|";
  }
  fmt::print("{}\n{}\n", head, rule);
  for (const Row& row : rows) {
    fmt::print("| {} |", row.name);
    for (const int n : through) fmt::print(" {:+.2f} |", row.error(n));
    fmt::print("\n");
  }
}
