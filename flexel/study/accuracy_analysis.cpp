// Errors and what they cost. Extrapolation is that of the error bars (simulate/result/estimate.h).
#include "flexel/study/accuracy_analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/units.h"
#include "simulate/result/estimate.h"

namespace flexel::study {
namespace {

constexpr double kTargets[] = {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5};
constexpr double kUsualTarget = 0.01;
constexpr double kMostBelievedOrder = 3;  // cells close in with order 2: more is chance
constexpr double kMostUncertain = 0.25;   // of the value: a reference that is known worse is none

// Of three sizes. `believed`: false where they converge faster than the models' order allows.
simulate::Bar bar_of(const std::vector<SizeValue>& values, std::size_t finest, bool& believed) {
  simulate::Sequence sequence;
  for (std::size_t i = 0; i < 3; ++i) sequence.value.at(i) = values[finest - i].value;
  for (std::size_t i = 0; i < 2; ++i)
    sequence.ratio.at(i) = values[finest - i - 1].spacing / values[finest - i].spacing;
  const simulate::Bar bar = richardson(sequence);
  believed = !bar.order || *bar.order <= kMostBelievedOrder;
  return believed ? bar : wide_bar(sequence);
}

// Three times the largest difference of the finest three; of one value its whole size.
double wide_range(const std::vector<SizeValue>& values) {
  if (values.size() == 1) return std::abs(values.back().value);
  double largest = 0;
  for (std::size_t i = values.size() - 1; i > 0 && i + 3 > values.size(); --i)
    largest = std::max(largest, std::abs(values[i].value - values[i - 1].value));
  return 3 * largest;
}

std::vector<SizeValue> resolved_of(const std::vector<SizeValue>& values) {
  std::vector<SizeValue> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result),
               [](const SizeValue& each) { return each.resolved; });
  return result;
}

std::string quantity_text(double value, const std::string& unit) {
  return unit == "m" ? human_length(value) : fmt::format("{:.3g} {}", value, unit);
}

// What a point's error is known to be at most.
double bound(const Point& point) {
  return point.error->error + point.error->uncertainty;
}

std::string percent(double share) {
  return share < 0.995 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string factor(double value) {
  if (value < 10) return fmt::format("{:.1f}", value);
  if (value < 10'000) return fmt::format("{:.0f}", value);
  return "over 10,000";
}

}  // namespace

Reference extrapolate(const std::string& name, const std::string& unit, const std::vector<SizeValue>& all) {
  Reference result;
  result.name = name;
  result.unit = unit;
  if (all.empty()) return result;
  const std::vector<SizeValue> values = resolved_of(all);
  const std::size_t n = values.size();
  if (n < 3) {
    result.value = all.back().value;
    result.uncertainty = wide_range(all);
    result.from = all.size() == 1 ? "the only size" : fmt::format("finest of {} sizes", all.size());
    result.doubt = n == all.size()
                       ? "three sizes are needed to tell how far a value is from its limit"
                       : fmt::format(
                             "only {} of {} sizes have two cells or more through the walls, and three are "
                             "needed",
                             n, all.size());
    return result;
  }
  bool believed = true, before_believed = true;
  const simulate::Bar bar = bar_of(values, n - 1, believed);
  result.value = bar.extrapolated;
  result.uncertainty = bar.half_width;
  result.order = bar.order;
  result.from = bar.order  ? "extrapolated from 3 sizes"
                : believed ? "finest of 3 sizes, no even limit"
                           : "finest of 3 sizes, which close in faster than cells do";
  if (n > 3) {
    const simulate::Bar before = bar_of(values, n - 2, before_believed);
    result.uncertainty = std::max(result.uncertainty, 0.5 * std::abs(before.extrapolated - bar.extrapolated));
  }
  if (!(result.uncertainty <= kMostUncertain * std::abs(result.value)) && result.uncertainty > 0)
    result.doubt = "its values have not come near a limit yet";
  return result;
}

double half_range(const std::vector<SizeValue>& values) {
  const std::vector<SizeValue> resolved = resolved_of(values);
  if (resolved.size() < 3 || !values.back().resolved) return wide_range(values);
  const Reference limit = extrapolate("", "", values);
  return std::abs(limit.value - values.back().value) + limit.uncertainty;
}

std::vector<std::string> doubtful_sentences(const std::vector<Reference>& references) {
  std::vector<std::string> result;
  for (const Reference& each : references)
    if (each.decides && !each.doubt.empty()) {
      if (result.empty()) result.push_back(fmt::format("The error of no run is known: {}.", each.doubt));
      result.push_back(fmt::format("{}: {} by the finest size; it may be anything from {} to {}.", each.name,
                                   quantity_text(each.value, each.unit),
                                   quantity_text(std::max(0.0, each.value - each.uncertainty), each.unit),
                                   quantity_text(each.value + each.uncertainty, each.unit)));
    }
  if (!result.empty()) result.emplace_back("A larger --budget goes on to finer sizes.");
  return result;
}

std::optional<RunError> error_of(const RunResult& run, const std::vector<Reference>& references) {
  std::optional<RunError> result;
  for (const Reference& reference : references) {
    if (!reference.decides || reference.value == 0) continue;
    if (!reference.doubt.empty()) return std::nullopt;
    const Quantity* found = run.find(reference.name);
    if (found == nullptr) continue;
    if (!result) result.emplace();
    const double size = std::abs(reference.value);
    result->error = std::max(result->error, std::abs(found->value - reference.value) / size);
    result->uncertainty = std::max(result->uncertainty, reference.uncertainty / size);
  }
  return result;
}

std::vector<std::size_t> frontier(const std::vector<Point>& points) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].choosable && points[i].error) order.push_back(i);
  const auto shown = [&](std::size_t i) {
    return std::max(points[i].error->error, points[i].error->uncertainty);
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].seconds != points[b].seconds ? points[a].seconds < points[b].seconds
                                                  : shown(a) < shown(b);
  });
  std::vector<std::size_t> result;
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order)
    if (shown(i) < best) {
      best = shown(i);
      result.push_back(i);
    }
  return result;
}

std::optional<std::size_t> cheapest_within(const std::vector<Point>& points, double target) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].choosable || !points[i].error || bound(points[i]) > target) continue;
    if (!best || points[i].seconds < points[*best].seconds) best = i;
  }
  return best;
}

std::optional<double> cost_of_tenfold(const std::vector<Point>& points) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, least = 1e300, most = 0;
  for (const Point& point : points) {
    if (point.sweep != "resolution" || !point.error) continue;
    const double error = point.error->error;
    if (!(error > point.error->uncertainty) || !(error > 0)) continue;
    const double x = -std::log10(error), y = std::log10(point.seconds);
    n += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    least = std::min(least, error);
    most = std::max(most, error);
  }
  if (n < 2 || most < 2 * least) return std::nullopt;
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  if (!(slope > 0)) return std::nullopt;
  return std::pow(10.0, slope);
}

std::vector<std::string> sentences(const std::vector<Point>& points) {
  std::vector<std::string> result;
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].choosable && points[i].error && (!best || bound(points[i]) < bound(points[*best])))
      best = i;
  if (!best) return {"No run tells an error: a probe, or a second size, is needed."};
  double target = kUsualTarget;
  std::optional<std::size_t> chosen = cheapest_within(points, target);
  if (!chosen) {
    result.push_back(fmt::format("No run is known to be within 1 %; the best is {}: {} off, give or take {}.",
                                 points[*best].options, percent(points[*best].error->error),
                                 percent(points[*best].error->uncertainty)));
    for (const double each : kTargets)
      if (!chosen && each > kUsualTarget) {
        chosen = cheapest_within(points, each);
        target = each;
      }
  }
  if (chosen)
    result.push_back(fmt::format("For {} use {}: {}, {}.", percent(target), points[*chosen].options,
                                 human_seconds(points[*chosen].seconds),
                                 human_bytes(points[*chosen].memory)));
  if (const std::optional<double> cost = cost_of_tenfold(points))
    result.push_back(fmt::format("Ten times the accuracy costs {} times the time.", factor(*cost)));
  else
    result.emplace_back("The sizes that were run do not tell what ten times the accuracy costs.");
  return result;
}

Agreement compare(const Reference& ours, const std::vector<SizeValue>& theirs) {
  Agreement result{ours, extrapolate(ours.name, ours.unit, theirs), 0, false};
  if (theirs.empty()) return result;
  result.finest = theirs.back().value;
  result.agree = std::abs(result.theirs.value - ours.value) <= result.theirs.uncertainty + ours.uncertainty;
  return result;
}

std::string against_sentence(const std::vector<Point>& points) {
  std::vector<Point> theirs;
  for (const Point& each : points)
    if (each.sweep == "calculix" && each.error) theirs.push_back(each);
  if (theirs.empty()) return "";
  for (Point& each : theirs) each.choosable = true;
  for (const double target : kTargets) {
    if (target < kUsualTarget) continue;
    if (const std::optional<std::size_t> chosen = cheapest_within(theirs, target))
      return fmt::format("For {} CalculiX takes {}: {} with meshing, {}.", percent(target),
                         theirs[*chosen].options, human_seconds(theirs[*chosen].seconds),
                         human_bytes(theirs[*chosen].memory));
  }
  return "No run of CalculiX is known to be within 50 %.";
}

Median median(std::vector<double> values) {
  if (values.empty()) return {0, std::numeric_limits<double>::infinity()};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double middle = n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
  if (n < 3 || !(middle > 0)) return {middle, std::numeric_limits<double>::infinity()};
  const double count = static_cast<double>(n);
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double squares = 0;
  for (const double each : values) squares += (each - mean) * (each - mean);
  return {middle, 1.2533 * std::sqrt(squares / (count - 1) / count) / middle};
}

std::string option_length(double metres) {
  return metres >= 1e-3 ? fmt::format("{:.3g}mm", 1e3 * metres) : fmt::format("{:.3g}um", 1e6 * metres);
}

std::string human_seconds(double seconds) {
  if (seconds < 1) return fmt::format("{:.0f} ms", 1e3 * seconds);
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  const auto whole = static_cast<long>(std::lround(seconds));
  return fmt::format("{} min {} s", whole / 60, whole % 60);
}

}  // namespace flexel::study
