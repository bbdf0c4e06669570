// The formats that assimp reads and we do not, read only. Left out are those that hold movements, terrains or archives
// of games, and extensions that mean other things too (.mesh, .xml, .3d).
#include "formats/assimp/assimp_formats.h"

#include <array>

namespace flexel {
namespace {

using Extension = std::array<std::string_view, 1>;
constexpr std::array<std::string_view, 2> kAcExtensions = {"ac3d", "acc"};
constexpr Extension kAseExtensions = {"ask"}, kNffExtensions = {"enff"}, kQ3oExtensions = {"q3s"},
                    kLwoExtensions = {"lxo"}, kXglExtensions = {"zgl"};

// The unit is the file's own, or one that the format prescribes.
constexpr FileFormat with_unit(std::string_view name, std::string_view title,
                               std::span<const std::string_view> extensions = {}) {
  return {.name = name,
          .title = title,
          .extensions = extensions,
          .carries_unit = true,
          .by_assimp = true,
          .in_single_precision = [](const SurfaceSource&) { return true; }};
}

constexpr FileFormat without_unit(std::string_view name, std::string_view title,
                                  std::span<const std::string_view> extensions = {}) {
  FileFormat format = with_unit(name, title, extensions);
  format.carries_unit = false;
  return format;
}

struct Row {
  FileFormat format;
  FormatMark mark;
};

constexpr std::array<Row, kAssimpFormats> kRows = {{
    Row{with_unit("fbx", "FBX"), {"Kaydara FBX Binary"}},
    Row{with_unit("dae", "Collada"), {"<COLLADA", true}},
    Row{without_unit("3ds", "3DS"), {}},
    Row{with_unit("amf", "AMF"), {"<amf", true}},
    Row{with_unit("x3d", "X3D"), {"<X3D", true}},
    Row{without_unit("dxf", "DXF"), {}},
    Row{with_unit("lwo", "LightWave", kLwoExtensions), {}},
    Row{without_unit("ms3d", "MilkShape"), {"MS3D000000"}},
    Row{with_unit("blend", "Blender"), {"BLENDER"}},
    Row{without_unit("ac", "AC3D", kAcExtensions), {"AC3D"}},
    Row{without_unit("ase", "ASE", kAseExtensions), {"*3DSMAX_ASCIIEXPORT"}},
    Row{without_unit("x", "DirectX"), {"xof 0"}},
    Row{without_unit("xgl", "XGL", kXglExtensions), {"<WORLD", true}},
    Row{without_unit("ogex", "OpenGEX"), {}},
    Row{without_unit("cob", "trueSpace"), {"Caligari"}},
    Row{without_unit("nff", "NFF", kNffExtensions), {}},
    Row{without_unit("ndo", "Nendo"), {"nendo"}},
    Row{without_unit("q3o", "Quick3D", kQ3oExtensions), {"quick3D"}},
    Row{without_unit("sib", "Silo"), {}},
    Row{without_unit("irrmesh", "Irrlicht"), {}},
    Row{without_unit("b3d", "Blitz3D"), {"BB3D"}},
    Row{without_unit("iqm", "IQM"), {"INTERQUAKEMODEL"}},
    Row{without_unit("pmx", "PMX"), {"PMX "}},
    Row{without_unit("md2", "MD2"), {"IDP2"}},
    Row{without_unit("md3", "MD3"), {"IDP3"}},
    Row{without_unit("md5mesh", "MD5"), {"MD5Version"}},
    Row{without_unit("mdl", "MDL"), {}},
    Row{without_unit("smd", "SMD"), {}},
}};

constexpr auto formats_of_rows() {
  std::array<FileFormat, kAssimpFormats> formats;
  for (std::size_t i = 0; i < kRows.size(); ++i) formats[i] = kRows[i].format;
  return formats;
}

constexpr std::array kFormats = formats_of_rows();

}  // namespace

std::span<const FileFormat, kAssimpFormats> assimp_formats() {
  return kFormats;
}

FormatMark assimp_mark(std::size_t format) {
  return kRows[format].mark;
}

}  // namespace flexel
