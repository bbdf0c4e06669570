// What is written as a row is read back, whatever its fields hold.
#include "base/files/csv.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

namespace flexel {
namespace {

TEST(Csv, RowsComeBack) {
  std::mt19937 random(3);
  const std::string letters = "ab ,\"\n\r;'";
  for (int round = 0; round < 300; ++round) {
    std::vector<std::vector<std::string>> rows(1 + random() % 3);
    std::string text;
    for (auto& row : rows) {
      row.resize(1 + random() % 4);
      for (std::size_t f = 0; f < row.size(); ++f) {
        for (std::size_t n = random() % 6; n > 0; --n) row[f] += letters[random() % letters.size()];
        if (f > 0) text += ',';
        text += csv_field(row[f]);
      }
      text += '\n';
    }
    std::istringstream in(text);
    std::vector<std::string> read;
    for (const auto& row : rows) {
      ASSERT_TRUE(read_csv_row(in, read));
      EXPECT_EQ(read, row) << text;
    }
    EXPECT_FALSE(read_csv_row(in, read));
  }
}

TEST(Csv, PlainFieldsStayAsTheyAre) {
  EXPECT_EQ(csv_field("tip x [m]"), "tip x [m]");
  EXPECT_EQ(csv_field("arm, left"), "\"arm, left\"");
  EXPECT_EQ(csv_field("the \"arm\""), "\"the \"\"arm\"\"\"");
}

}  // namespace
}  // namespace flexel
