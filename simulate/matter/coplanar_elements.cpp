// Elements are looked at until none is left; each that is found has its neighbours looked at again without
// it.
#include "simulate/matter/coplanar_elements.h"
#include "base/math/eigenvalues.h"

#include "simulate/models/connections.h"

namespace flexel::simulate {
namespace {

constexpr double kFlat = 1e-9;  // least over greatest spread of the connections
constexpr double kSupportShare = 1e-3;

class UnsupportedSearch {
 public:
  explicit UnsupportedSearch(const Problem& problem)
      : problem_(problem),
        connections_(make_connections(problem)),
        rows_(connection_rows(connections_, problem.body.element_count())),
        found_(problem.body.element_count(), 0) {}

  std::vector<std::uint8_t> operator()() {
    for (std::size_t p = 0; p < problem_.body.parts.size(); ++p)
      if (problem_.body.parts[p].placement == Placement::centre) search(p);
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool simulated(std::uint32_t e) const {
    return !found_[e] && !(e < problem_.stray_element.size() && problem_.stray_element[e]);
  }

  [[nodiscard]] bool flat(std::uint32_t e, const ConnectionKinds& kinds) const {
    Mat3 spread = Mat3::Zero();
    for (const ConnectionRows::Entry& entry : rows_.of(e))
      if (simulated(entry.other)) {
        const Vec3 direction = kinds[entry.kind].rest / kinds[entry.kind].length;
        spread += direction * direction.transpose();
      }
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread, Eigen::EigenvaluesOnly);
    return !(eigen.eigenvalues()[0] > kFlat * eigen.eigenvalues()[2]);
  }

  void search(std::size_t p) {
    const Part& part = problem_.body.parts[p];
    const ConnectionKinds& kinds = connections_.parts[p].kinds;
    const double most = kSupportShare * (part.element_end - part.element_begin);
    std::vector<std::uint32_t> pending, marked;
    for (std::uint32_t e = part.element_end; e > part.element_begin; --e) pending.push_back(e - 1);
    while (!pending.empty()) {
      const std::uint32_t e = pending.back();
      pending.pop_back();
      if (!simulated(e) || !flat(e, kinds)) continue;
      found_[e] = 1;
      marked.push_back(e);
      if (static_cast<double>(marked.size()) > most) {
        for (const std::uint32_t each : marked) found_[each] = 0;
        return;
      }
      for (const ConnectionRows::Entry& entry : rows_.of(e)) pending.push_back(entry.other);
    }
  }

  const Problem& problem_;
  Connections connections_;
  ConnectionRows rows_;
  std::vector<std::uint8_t> found_;
};

}  // namespace

std::vector<std::uint8_t> unsupported_elements(const Problem& problem) {
  return UnsupportedSearch(problem)();
}

}  // namespace flexel::simulate
