// Courses: parsing and linear interpolation.
#include "simulate/conditions/time_curve.h"

#include <algorithm>

namespace flexel::simulate {

double TimeCurve::at(const State& state) const {
  if (!state.time) return state.share;
  if (time.empty()) return 1;
  const auto next = std::upper_bound(time.begin(), time.end(), *state.time);
  if (next == time.begin()) return factor.front();
  if (next == time.end()) return factor.back();
  const auto i = static_cast<std::size_t>(next - time.begin());
  const double share = (*state.time - time[i - 1]) / (time[i] - time[i - 1]);
  return factor[i - 1] + share * (factor[i] - factor[i - 1]);
}

TimeCurve parse_course(TableReader& reader) {
  TimeCurve course;
  const SceneValue* times = reader.find("time");
  const SceneValue* factors = reader.find("factor");
  if (!times && !factors) return course;
  if (!times || !factors || times->kind != SceneValue::Kind::array ||
      factors->kind != SceneValue::Kind::array || times->items.size() != factors->items.size() ||
      times->items.empty())
    reader.fail(
        (times ? times : factors)->line,
        "\"time\" and \"factor\" go together, for example time = [\"0 s\", \"1 s\"], factor = [0, 1]");
  for (std::size_t i = 0; i < times->items.size(); ++i) {
    course.time.push_back(reader.to_quantity(times->items[i], Dimension::time, "time"));
    if (factors->items[i].kind != SceneValue::Kind::number)
      reader.fail(factors->line, "\"factor\" needs bare numbers, for example [0, 1]");
    course.factor.push_back(factors->items[i].number);
    if (i > 0 && !(course.time[i] > course.time[i - 1])) reader.fail(times->line, "\"time\" needs to ascend");
  }
  return course;
}

}  // namespace flexel::simulate
