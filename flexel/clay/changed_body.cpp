// All changes happen anew each time, as in a run of the scene: glue is as stiff as the material is now.
#include "flexel/clay/changed_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "base/error.h"
#include "flexel/view/page.h"
#include "flexel/view/view_file.h"
#include "simulate/scene/scene.h"
#include "simulate/time/before_equilibrium.h"

namespace flexel::clay {
namespace {

constexpr const char* kNumberColumn = "number_at_start";  // of elements, while changes happen

// (elements of `now`) m
std::vector<Vec3> carried_over(const ClayDocument& document, const std::vector<std::uint32_t>& now) {
  const std::vector<std::uint32_t>& before = *document.now.element;
  std::vector<Vec3> by_number(1 + *std::max_element(before.begin(), before.end()), Vec3::Zero()), carried;
  for (std::size_t e = 0; e < before.size(); ++e) by_number[before[e]] = (*document.displacement)[e];
  for (const std::uint32_t number : now) carried.push_back(by_number[number]);
  return carried;
}

}  // namespace

void apply_changes(ClayDocument& document, const std::string& base) {
  const simulate::Scene scene =
      simulate::parse_scene(scene_text(document, base, false), "what acts on the part");
  auto body = std::make_shared<Body>(*document.start.body);
  std::vector<double> numbers(body->element_count());
  std::iota(numbers.begin(), numbers.end(), 0.0);
  body->element_columns[kNumberColumn] = {1, std::move(numbers)};
  Progress silent("", Progress::Mode::silent);
  happen_before_equilibrium(*body, scene, silent);
  auto element = std::make_shared<std::vector<std::uint32_t>>();
  for (const double number : body->element_columns.at(kNumberColumn).values)
    element->push_back((*document.start.element)[static_cast<std::size_t>(number)]);
  body->element_columns.erase(kNumberColumn);
  document.displacement = std::make_shared<const std::vector<Vec3>>(carried_over(document, *element));
  document.now = {std::move(body), std::move(element)};
}

std::string surface_pack(const NumberedBody& body) {
  view::ViewFile file;
  try {
    file = view::make_live_file(*body.body, "");
  } catch (const InputError& error) {
    throw InputError(fmt::format("carve: what is left cannot be closed ({})", error.what()));
  }
  for (std::uint32_t& carrier : file.surface->carriers) carrier = (*body.element)[carrier];
  const Bytes bytes = view::pack_file(file, true);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace flexel::clay
