// What CAD files look like. Without OpenCASCADE they are known all the same, to be refused by name.
#include "formats/cad/cad_readers.h"

namespace flexel {
namespace {

Evidence text_if(bool found) {
  return found ? Evidence::text : Evidence::none;
}

bool looks_like_brep(std::string_view text) {
  constexpr std::string_view kBinary = "Open CASCADE Topology V";
  return begins_with_word(text, "dbrep_drawableshape") || begins_with_word(text, "cascade topology v") ||
         text.substr(0, kBinary.size() + 1).find(kBinary) != std::string_view::npos;
}

// The first line is 80 characters long: text, an S in column 73, and the number 1.
bool looks_like_iges(std::string_view text) {
  constexpr std::size_t kLetter = 72, kLine = 80;
  if (text.size() < kLine || text[kLetter] != 'S') return false;
  const std::string_view number = text.substr(kLetter + 1, kLine - kLetter - 1);
  return number.find_first_not_of(" 0") == number.size() - 1 && number.back() == '1' &&
         text.substr(0, kLine).find('\n') == std::string_view::npos;
}

bool is_always_text(const ImportInput&) {
  return true;
}

}  // namespace

constinit const FileReader kStepReader{
    .format = &kStepFormat,
    .sniff =
        [](const ImportInput& input) {
          return begins_with_word(beginning(input), "iso-10303-21") ? Evidence::magic : Evidence::none;
        },
    .read = read_step,
    .is_text = is_always_text};
constinit const FileReader kIgesReader{
    .format = &kIgesFormat,
    .sniff = [](const ImportInput& input) { return text_if(looks_like_iges(beginning(input))); },
    .read = read_iges,
    .is_text = is_always_text};
constinit const FileReader kBrepReader{
    .format = &kBrepFormat,
    .sniff = [](const ImportInput& input) { return text_if(looks_like_brep(beginning(input))); },
    .read = read_brep};

}  // namespace flexel
