// The file is Flexel's own: one line of names, then numbers and commas. The lag is found by a scan of shifts,
// then by a parabola through the best three.
#include "flexel/study/runs/history_csv.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "base/error.h"
#include "base/files/csv.h"

namespace flexel::study {
namespace {

constexpr int kShifts = 400;  // to either side

// Linear between the rows, constant outside.
double at(const std::vector<double>& time, const std::vector<double>& value, double t) {
  const auto after = std::upper_bound(time.begin(), time.end(), t);
  if (after == time.begin()) return value.front();
  if (after == time.end()) return value.back();
  const auto i = static_cast<std::size_t>(after - time.begin());
  const double share = (t - time[i - 1]) / (time[i] - time[i - 1]);
  return (1 - share) * value[i - 1] + share * value[i];
}

}  // namespace

const std::vector<double>* History::find(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? nullptr : &columns[static_cast<std::size_t>(found - names.begin())];
}

History read_history(const std::string& path) {
  std::ifstream in(path);
  History history;
  if (!read_csv_row(in, history.names)) throw InputError(path, "no table of a timed run");
  if (history.names.front() != "time [s]")
    throw InputError(path, "the first column of a timed run's table is \"time [s]\"");
  history.names.erase(history.names.begin());
  history.columns.resize(history.names.size());
  for (std::vector<std::string> cells; read_csv_row(in, cells);) {
    if (cells.size() != history.names.size() + 1) throw InputError(path, "a row is cut short");
    history.time.push_back(std::strtod(cells[0].c_str(), nullptr));
    for (std::size_t c = 1; c < cells.size(); ++c)
      history.columns[c - 1].push_back(std::strtod(cells[c].c_str(), nullptr));
  }
  return history;
}

std::vector<double> probe_motion(const History& history, const std::string& probe) {
  std::vector<double> motion(history.time.size(), 0.0);
  for (const char* axis : {" x [m]", " y [m]", " z [m]"}) {
    const std::vector<double>* column = history.find(probe + axis);
    if (column == nullptr) return {};
    for (std::size_t i = 0; i < motion.size(); ++i) motion[i] += (*column)[i] * (*column)[i];
  }
  for (double& each : motion) each = std::sqrt(each);
  return motion;
}

std::optional<double> peak(const std::vector<double>& motion) {
  std::optional<double> most;
  for (const double each : motion)
    if (std::isfinite(each)) most = std::max(most.value_or(each), each);
  return most;
}

std::optional<double> lag(const std::vector<double>& time, const std::vector<double>& motion,
                          const std::vector<double>& reference_time, const std::vector<double>& reference) {
  if (time.size() < 2 || reference_time.size() < 2 || motion.size() != time.size() ||
      reference.size() != reference_time.size())
    return std::nullopt;
  const auto is_finite = [](double value) { return std::isfinite(value); };  // of what was not there yet
  if (!std::all_of(motion.begin(), motion.end(), is_finite) ||
      !std::all_of(reference.begin(), reference.end(), is_finite))
    return std::nullopt;
  const auto [least, most] = std::minmax_element(reference.begin(), reference.end());
  if (!(*most > *least)) return std::nullopt;
  const double end = std::min(time.back(), reference_time.back());
  const double reach = end / 4, step = reach / kShifts;
  // Only times that both motions have at every shift: the middle half of the run.
  const auto difference = [&](int shift) {
    double sum = 0;
    for (int i = 0; i <= 2 * kShifts; ++i) {
      const double t = reach + i * step;
      const double d = at(time, motion, t + shift * step) - at(reference_time, reference, t);
      sum += d * d;
    }
    return sum;
  };
  int best = 0;
  double lowest = difference(0);
  for (int shift = 1; shift <= kShifts; ++shift)
    for (const int signed_shift : {shift, -shift})
      if (const double found = difference(signed_shift); found < lowest) {
        lowest = found;
        best = signed_shift;
      }
  if (std::abs(best) == kShifts) return best * step;
  const double before = difference(best - 1), after = difference(best + 1);
  const double curvature = before - 2 * lowest + after;
  const double fine = curvature > 0 ? 0.5 * (before - after) / curvature : 0;
  return (best + std::clamp(fine, -0.5, 0.5)) * step;
}

}  // namespace flexel::study
