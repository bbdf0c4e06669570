// A hand seldom goes on exactly as it went, but a few motions span all that it does. Older ones are made perpendicular to the newest,
// their answers with them: an answer is linear in its way while the part does not change much.
#include "flexel/clay/answers.h"

#include <algorithm>
#include <utility>

#include "base/parallel.h"

namespace flexel::clay {
namespace {

constexpr std::size_t kMostKnown = 4;
constexpr double kLeastLeft = 0.1;      // of a way's square, that the newer ones do not span
constexpr double kLeastTaught = 1e-12;  // of the arm's square

void subtract(Way& way, const Way& other, double share) {
  for (std::size_t t = 0; t < way.size(); ++t) way[t] = way[t] - other[t] * share;
}

void add_share(std::vector<Vec3>& values, const std::vector<Vec3>& other, double share) {
  parallel_for_each(values.size(), [&](std::size_t e) { values[e] += share * other[e]; });
}

}  // namespace

double dot(const Way& a, const Way& b, double arm) {
  double sum = 0;
  for (std::size_t t = 0; t < a.size(); ++t) sum += a[t].dot(b[t], arm);
  return sum;
}

Way way_between(const Way& from, const Way& to) {
  Way way(to.size());
  for (std::size_t t = 0; t < to.size(); ++t) way[t] = to[t] - from[t];
  return way;
}

void Answers::learn(Way way, const std::vector<Vec3>& before, const std::vector<Vec3>& after) {
  const double length = dot(way, way, arm_);
  if (!(length > kLeastTaught * arm_ * arm_)) return;
  Known newest{std::move(way), std::vector<Vec3>(after.size())};
  parallel_for_each(after.size(), [&](std::size_t e) { newest.answer[e] = after[e] - before[e]; });
  std::vector<Known> kept;
  kept.push_back(std::move(newest));
  for (Known& known : known_) {
    const double was = dot(known.way, known.way, arm_);
    for (const Known& newer : kept) {
      const double share = dot(known.way, newer.way, arm_) / dot(newer.way, newer.way, arm_);
      subtract(known.way, newer.way, share);
      add_share(known.answer, newer.answer, -share);
    }
    if (kept.size() < kMostKnown && dot(known.way, known.way, arm_) > kLeastLeft * was)
      kept.push_back(std::move(known));
  }
  known_ = std::move(kept);
}

void Answers::add(Way way, std::vector<Vec3>& displacement) const {
  for (const Known& known : known_) {
    const double share = dot(known.way, way, arm_) / dot(known.way, known.way, arm_);
    subtract(way, known.way, share);
    add_share(displacement, known.answer, share);
  }
}

}  // namespace flexel::clay
