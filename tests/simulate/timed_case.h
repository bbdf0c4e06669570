// Runs a scene in time and gives what came out, with its books.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/scratch.h"
#include "tests/simulate/csv.h"

namespace flexel::simulate::testing {

struct TimedCase {
  Body body;
  SimulateResult result;
  Csv history;
};

inline TimedCase run_timed(Body body, const Scene& scene, SimulateOptions options = {}) {
  TimedCase made;
  made.body = std::move(body);
  Progress progress("test", Progress::Mode::quiet);
  const flexel::test::Scratch scratch;
  options.history = scratch.path("history.csv");
  made.result = simulate(made.body, scene, options, progress);
  made.history = read_csv(options.history);
  return made;
}

// J, of the summary's books.
inline double book(const SimulateResult& result, const std::string& name) {
  for (const auto& [each, joules] : result.timed->books)
    if (each == name) return joules;
  ADD_FAILURE() << "the books have no " << name;
  return std::nan("");
}

// The books close within 0.1 % of the largest term.
inline void expect_books_close(const SimulateResult& result) {
  EXPECT_GT(book(result, "largest_term"), 0);
  EXPECT_LT(book(result, "worst_residual"), 1e-3 * book(result, "largest_term"));
}

// Momentum and angular momentum stay what they were, to `tolerance` of their largest component.
inline void expect_momenta_kept(const Csv& history, double tolerance) {
  for (const std::string name : {"momentum", "angular momentum"}) {
    double largest = 0;
    for (const char* axis : {" x", " y", " z"})
      largest = std::max(largest, std::abs(history.column(name + axis)[0]));
    for (const char* axis : {" x", " y", " z"})
      for (const double value : history.column(name + axis))
        EXPECT_NEAR(value, history.column(name + axis)[0], tolerance * largest) << name << axis;
  }
}

}  // namespace flexel::simulate::testing
