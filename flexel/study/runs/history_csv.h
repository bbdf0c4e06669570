// Reads the energy history of a timed run (flexel-simulate --history); the time lag between two motions.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace flexel::study {

struct History {
  std::vector<double> time;                  // s, ascending
  std::vector<std::string> names;            // of the other columns, as in the file: "tip x [m]"
  std::vector<std::vector<double>> columns;  // (names) x (rows)
  [[nodiscard]] const std::vector<double>* find(const std::string& name) const;
};

// Throws InputError: missing, or no such table.
[[nodiscard]] History read_history(const std::string& path);

// Length of the displacement of a probe over time [m]; empty where there is no such probe.
[[nodiscard]] std::vector<double> probe_motion(const History& history, const std::string& probe);

// The largest of it, rows without a number left out; nothing where there is none.
[[nodiscard]] std::optional<double> peak(const std::vector<double>& motion);

// The time [s] by which `motion` lags `reference` (both of the same probe): the shift, up to a quarter of the
// shorter run, at which the mean squared difference is least; nothing where the reference does not move.
[[nodiscard]] std::optional<double> lag(const std::vector<double>& time, const std::vector<double>& motion,
                                        const std::vector<double>& reference_time,
                                        const std::vector<double>& reference);

}  // namespace flexel::study
