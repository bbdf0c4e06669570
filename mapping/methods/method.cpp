// The list of methods, and their names.
#include "mapping/methods/method.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "base/error.h"
#include "base/nearest_word.h"
#include "formats/lattice/quadratic_field.h"

namespace flexel::mapping {
namespace {

constexpr std::array<MapMethod, 5> kMethods = {&kBlended, &kSmooth, &kAffine, &kGramSchmidt,
                                               &kShapeFunctions};

// "a, b or c".
std::string any_of_these(const std::vector<std::string>& words) {
  const std::size_t last = words.size() - 1;
  return fmt::format("{}{}{}",
                     fmt::join(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(last), ", "),
                     last > 0 ? " or " : "", words[last]);
}

}  // namespace

std::span<const MapMethod> map_methods() {
  return kMethods;
}

MapMethod default_method(const Body& body) {
  return QuadraticField::is_in(body) ? &kShapeFunctions : &kBlended;
}

std::string method_help() {
  std::vector<std::string> words;
  for (const MapMethod method : kMethods)
    words.push_back(method->help.empty() ? name_of(method)
                                         : fmt::format("{} ({})", method->name, method->help));
  return any_of_these(words);
}

std::string saved_method_names() {
  std::vector<std::string> words;
  for (const MapMethod method : kMethods)
    if (method->file_number >= 0) words.push_back(name_of(method));
  return any_of_these(words);
}

MapMethod map_method(const std::string& name) {
  std::vector<std::string> names;
  for (const MapMethod method : kMethods) {
    if (method->name == name) return method;
    names.push_back(name_of(method));
  }
  throw InputError(fmt::format("unknown method \"{}\": --method is {}{}", name, fmt::join(names, ", "),
                               did_you_mean(name, names)));
}

std::string name_of(MapMethod method) {
  return std::string(method->name);
}

}  // namespace flexel::mapping
