// What is refused before a run for the memory it takes, and in which words.
#include "simulate/result/memory_limit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/resources.h"

namespace flexel::simulate {
namespace {

TEST(Memory, WithoutALimitOnlyWhatSurelyDoesNotFitIsRefused) {
  refuse_beyond_memory(1.1 * available_memory(), "10 elements",
                       "scene.toml");  // the estimate may be off by more
  try {
    refuse_beyond_memory(1e18, "10 elements", "scene.toml");
    FAIL() << "a million terabytes";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("10 elements"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("free memory"));
    EXPECT_THAT(error.what(), ::testing::Not(::testing::HasSubstr("--max-memory")));
  }
}

}  // namespace
}  // namespace flexel::simulate
