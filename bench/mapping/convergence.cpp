// Prints how well each method of mapping follows known motions of all elements, as the Markdown table of
// docs/measurements/mapping-accuracy.md: root mean square error of the vertices by spacing, its order of convergence, the normal
// jump between neighbouring triangles; then what each method costs there. Rows in brackets are no methods of
// the product: they are what `blended` would give with other frames.
//
//   convergence [corner|centre]
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cstring>

#include "mapping/anchors/search.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "mapping/methods/blend.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

struct Motion {
  const char* name;
  test::Field field;
};

// The motions of the quadruple of each element, in place of the least squares fit.
std::vector<mapping::ElementMotion> quadruple_motions(const Body& body, const mapping::Binding& binding,
                                                      bool orthonormal) {
  const mapping::MovingElements& moving = blend_of(binding).moving;
  std::vector<mapping::ElementMotion> motions(moving.elements.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const std::uint32_t e = moving.elements[i];
    const mapping::Frame frame = find_frame(body, binding.connections, body.parts[0], e, 7);
    motions[i].displacement = body.position[e] - body.rest[e];
    motions[i].gradient = frame_motion(frame, body.rest, body.position, orthonormal).change *
                          rest_base(frame, body.rest, orthonormal).inverse();
  }
  return motions;
}

struct Row {
  const char* name;
  std::vector<Vec3> (*map)(const Body&);
};

template <mapping::MapMethod method>
std::vector<Vec3> mapped(const Body& body) {
  return apply(bind(body, method), body, body.position);
}
template <bool orthonormal>
std::vector<Vec3> blended_with(const Body& body) {
  const mapping::Binding binding = bind(body, &mapping::kBlended);
  return apply(blend_of(binding), body, quadruple_motions(body, binding, orthonormal));
}

constexpr std::array<Row, 6> kRows = {{
    {"`gram-schmidt`", mapped<&mapping::kGramSchmidt>},
    {"`affine`", mapped<&mapping::kAffine>},
    {"`blended`", mapped<&mapping::kBlended>},
    {"(blended, Gram-Schmidt frames)", blended_with<true>},
    {"(blended, affine frames)", blended_with<false>},
    {"`smooth`", mapped<&mapping::kSmooth>},
}};

void print_table(const char* title, std::vector<Body>& bodies, const std::vector<int>& across,
                 const Motion& motion) {
  fmt::print("\n{}, {}\n\n| method |", title, motion.name);
  for (const int n : across) fmt::print(" h = 1/{} |", n);
  fmt::print(" order | normal jump at h = 1/{} (degrees) |\n|---|", across[1]);
  for (std::size_t i = 0; i < across.size() + 2; ++i) fmt::print("---|");
  fmt::print("\n");
  for (Body& body : bodies) test::deform(body, motion.field);
  for (const Row& row : kRows) {
    fmt::print("| {} |", row.name);
    std::vector<double> error;
    double jump = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const std::vector<Vec3> displacement = row.map(bodies[i]);
      error.push_back(test::rms_error(bodies[i], displacement, motion.field));
      if (i == 1) jump = test::normal_jump(bodies[i], displacement, motion.field);
      fmt::print(" {:.1e} |", error.back());
    }
    const std::size_t last = error.size() - 1;
    if (error[last] < 1e-11)
      fmt::print(" exact |");
    else
      fmt::print(" {:.1f} |", std::log2(error[last - 1] / error[last]));
    fmt::print(" {:.2g} |\n", jump);
  }
}

// Median of repetitions, ns a vertex.
template <typename Work>
double cost(const Body& body, const Work& work) {
  std::array<double, 7> times{};
  for (double& time : times) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    time = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count() /
           static_cast<double>(body.surface.vertices.size());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

// The same surface on finer and finer lattices: what grows belongs to the elements, not to the vertices.
void print_costs(const std::vector<Body>& bodies, const std::vector<int>& across) {
  fmt::print("\nRound bar, {} vertices, all cores: ns a vertex\n\n| method |",
             bodies[0].surface.vertices.size());
  for (const char* what : {"bind", "apply"})
    for (const int n : across) fmt::print(" {}, h = 1/{} |", what, n);
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < 2 * across.size(); ++i) fmt::print("---|");
  fmt::print("\n");
  for (const auto& [name, method] : {std::pair{"gram-schmidt", &mapping::kGramSchmidt},
                                     {"affine", &mapping::kAffine},
                                     {"blended", &mapping::kBlended},
                                     {"smooth", &mapping::kSmooth}}) {
    fmt::print("| `{}` |", name);
    // as bench_mapping does: with weights kept for states to come
    for (const Body& body : bodies) fmt::print(" {:.0f} |", cost(body, [&] { (void)bind(body, method, 2); }));
    for (const Body& body : bodies) {
      const mapping::Binding bound = bind(body, method, 2);
      fmt::print(" {:.0f} |", cost(body, [&] { (void)apply(bound, body, body.position); }));
    }
    fmt::print("\n");
  }
  fmt::print("\nElements: ");
  for (const Body& body : bodies) fmt::print("{} ", body.element_count());
  fmt::print("\n");
}

}  // namespace
}  // namespace flexel::mapping

int main(int argc, char** argv) {
  using namespace flexel;
  using namespace flexel::mapping;
  const Placement placement =
      argc > 1 && std::strcmp(argv[1], "centre") == 0 ? Placement::centre : Placement::corner;
  fmt::print("Placement {}.\n", placement == Placement::centre ? "centre" : "corner");
  const std::vector<int> across = {8, 16, 32};
  std::vector<Body> bars, knots;
  for (const int n : across) bars.push_back(test::round_bar(n, placement, 256, 96));
  for (const Motion& motion : {Motion{"bent by 180 degrees", test::bend},
                               {"twisted by 360 degrees", test::twist},
                               {"stretched to twice its length", test::stretch},
                               {"turned", test::turn}})
    print_table("Round bar", bars, across, motion);
  const std::vector<int> knot_across = {6, 12, 24};
  for (const int n : knot_across) knots.push_back(test::knot(n, placement));
  for (const Motion& motion : {Motion{"bent", test::bend}, {"twisted", test::twist}})
    print_table("Trefoil knot", knots, knot_across, motion);
  print_costs(bars, across);
  return 0;
}
