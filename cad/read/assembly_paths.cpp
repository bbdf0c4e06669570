// Assemblies are compounds, and so are most parts: a compound that holds one solid and lends it its name is a part.
#include "cad/read/assembly_paths.h"

#include <fmt/format.h>

#include <TopExp_Explorer.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Shape.hxx>
#include <algorithm>
#include <map>

namespace flexel::cad {
namespace {

constexpr int kDeepest = 100;

bool is_part(const TopoDS_Shape& compound, const std::string& name, const ShapeLabels& labels) {
  TopExp_Explorer solids(compound, TopAbs_SOLID);
  if (!solids.More() || labels.solid_name(solids.Current()) != name) return false;
  solids.Next();
  return !solids.More();
}

// A slash divides the names of a path.
std::string as_component(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

void walk(const TopoDS_Shape& shape, const std::string& path, const ShapeLabels& labels, int depth,
          std::vector<std::string>& paths) {
  if (shape.ShapeType() == TopAbs_SOLID) return paths.push_back(path);
  if (depth > kDeepest) {  // deeper than any assembly: the solids keep this path
    for (TopExp_Explorer solids(shape, TopAbs_SOLID); solids.More(); solids.Next()) paths.push_back(path);
    return;
  }
  std::map<std::string, int> uses;
  for (TopoDS_Iterator member(shape); member.More(); member.Next()) {
    const TopoDS_Shape& below = member.Value();
    std::string name = below.ShapeType() < TopAbs_SOLID ? labels.assembly_name(below) : "";
    std::string inner = path;
    if (!name.empty() && !is_part(below, name, labels)) {
      name = as_component(name);
      if (const int use = ++uses[name]; use > 1) name += fmt::format("-{}", use);
      inner += (path.empty() ? "" : "/") + name;
    }
    walk(below, inner, labels, depth + 1, paths);
  }
}

}  // namespace

std::vector<std::string> assembly_paths(const CadShape& shape) {
  std::vector<std::string> paths;
  if (shape.shape->IsNull()) return paths;
  const bool compound = shape.shape->ShapeType() < TopAbs_SOLID;
  const std::string root = compound ? shape.labels.assembly_name(*shape.shape) : "";
  walk(*shape.shape, is_part(*shape.shape, root, shape.labels) ? "" : as_component(root), shape.labels, 0,
       paths);
  return paths;
}

}  // namespace flexel::cad
