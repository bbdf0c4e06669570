// STEP, IGES and OpenCASCADE's own BREP. No mesh is written as one: the part's own CAD file is, deformed.
#include <array>

#include "formats/common/file_format.h"

namespace flexel {
namespace {

constexpr std::array<std::string_view, 2> kStepExtensions = {"stp", "p21"};
constexpr std::array<std::string_view, 1> kIgesExtensions = {"igs"}, kBrepExtensions = {"brp"};

}  // namespace

constinit const FileFormat kStepFormat{
    .name = "step", .title = "STEP", .extensions = kStepExtensions, .carries_unit = true, .is_cad = true};
constinit const FileFormat kIgesFormat{
    .name = "iges", .title = "IGES", .extensions = kIgesExtensions, .carries_unit = true, .is_cad = true};
constinit const FileFormat kBrepFormat{.name = "brep",
                                       .title = "BREP",
                                       .extensions = kBrepExtensions,
                                       .encoding = FileEncoding::both,
                                       .is_cad = true};

}  // namespace flexel
