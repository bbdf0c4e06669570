// Assemblies are compounds, and so are most parts: a compound that holds one solid and lends it its name is a part.
#include "cad/read/assembly_paths.h"

#include <fmt/format.h>

#include <TopExp_Explorer.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Shape.hxx>
#include <algorithm>
#include <set>

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

std::string assembly_of(const TopoDS_Shape& shape, const ShapeLabels& labels) {
  return shape.ShapeType() < TopAbs_SOLID ? labels.assembly_name(shape) : "";
}

void walk(const TopoDS_Shape& shape, const std::string& path, const ShapeLabels& labels, int depth,
          std::vector<std::string>& paths) {
  if (shape.ShapeType() == TopAbs_SOLID) return paths.push_back(path);
  if (depth > kDeepest) {  // deeper than any assembly: the solids keep this path
    for (TopExp_Explorer solids(shape, TopAbs_SOLID); solids.More(); solids.Next()) paths.push_back(path);
    return;
  }
  std::set<std::string> names, taken;
  for (TopoDS_Iterator member(shape); member.More(); member.Next())
    names.insert(as_component(assembly_of(member.Value(), labels)));
  for (TopoDS_Iterator member(shape); member.More(); member.Next()) {
    const TopoDS_Shape& below = member.Value();
    const std::string own = assembly_of(below, labels);
    std::string inner = path;
    if (!own.empty() && !is_part(below, own, labels)) {
      std::string name = as_component(own);
      for (int use = 2; (use > 2 && names.count(name) > 0) || !taken.insert(name).second; ++use)
        name = fmt::format("{}-{}", as_component(own), use);
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
