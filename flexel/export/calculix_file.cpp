// Written in the order that CalculiX requires: nodes, elements, sets, materials, constraints, one step. Its
// limits: 16 entries a line, 20 characters a number, 80 a name.
#include "flexel/export/calculix_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "base/files/append_text.h"

namespace flexel::mesh_export {
namespace {

constexpr double kLength = 1e3, kStress = 1e-6, kDensity = 1e-12;  // mm, MPa, tonne/mm^3 from SI
constexpr std::size_t kPerLine = 16, kLongestName = 60;

// Letters, digits and "_", upper case as CalculiX keeps them, none twice.
class Names {
 public:
  std::string operator()(const std::string& text) {
    std::string name;
    for (const char c : text.substr(0, kLongestName))
      name += std::isalnum(static_cast<unsigned char>(c))
                  ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
                  : '_';
    std::string unique = name;
    for (int n = 2; !given_.insert(unique).second; ++n) unique = fmt::format("{}_{}", name, n);
    return unique;
  }

 private:
  std::set<std::string> given_;
};

class Writer {
 public:
  Writer(const Analysis& analysis, const CalculixOptions& options)
      : analysis_(analysis), mesh_(analysis.mesh), options_(options), names_(calculix_names(analysis)) {}

  std::string operator()() {
    head();
    nodes();
    elements();
    faces();
    materials();
    supports();
    ties();
    probes();
    step();
    return std::move(text_);
  }

 private:
  template <class... T>
  void line(fmt::format_string<T...> format, T&&... values) {
    append_text(text_, format, std::forward<T>(values)...);
    text_ += '\n';
  }
  // A comment; texts of others must not end it.
  void comment(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    line("** {}", text);
  }
  void list(const std::vector<std::uint32_t>& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      append_text(text_, "{}{}", numbers[i] + 1,
                  i % kPerLine == kPerLine - 1 || i + 1 == numbers.size() ? "\n" : ",");
    }
  }

  void head() {
    for (const std::string& each : options_.head) comment(each);
    comment("Units: mm, N, s, tonne, MPa");
    for (const std::string& each : mesh_.notes) comment("Mesh: " + each);
    for (const std::string& each : analysis_.warnings) comment("Note: " + each);
    comment(fmt::format("Geometry: {} deflection; {}", analysis_.large_deflection ? "large" : "small",
                        analysis_.why_deflection));
    line("*HEADING\nwritten by flexel");
  }

  void nodes() {
    line("*NODE, NSET=N_ALL");
    const std::vector<std::uint8_t> used = used_nodes(mesh_);
    for (std::size_t n = 0; n < used.size(); ++n)
      if (used[n]) {
        const Vec3 at = kLength * mesh_.body.rest[n];
        line("{},{:.12g},{:.12g},{:.12g}", n + 1, at.x(), at.y(), at.z());
      }
    std::size_t next = mesh_.body.rest.size();
    for (const AnalysisSupport& support : analysis_.supports)
      for (const NodeEquation& equation : support.equations)
        if (equation.value != 0) aside_.push_back(static_cast<std::uint32_t>(next++));
    if (aside_.empty()) return;
    comment("Nodes that stand for the right-hand sides of equations: no element has them");
    line("*NODE, NSET=N_ASIDE");
    for (const std::uint32_t node : aside_) line("{},0,0,0", node + 1);
  }

  [[nodiscard]] std::string section_name(std::size_t s) const {
    const MeshSection& section = mesh_.sections[s];
    const std::string& part = names_.parts[section.part];
    return section.fill == 1 ? part : fmt::format("{}_FILL_{:.0f}", part, 1000 * section.fill);
  }

  void elements() {
    const std::string type = mesh_.kind == AnalysisMesh::Kind::tetrahedra ? "C3D10" : options_.element;
    for (std::size_t s = 0; s < mesh_.sections.size(); ++s) {
      line("*ELEMENT, TYPE={}, ELSET=M_{}", type, section_name(s));
      for (std::size_t e = 0; e < mesh_.element_count(); ++e) {
        if (mesh_.section[e] != s) continue;
        append_text(text_, "{}", e + 1);
        for (std::uint32_t n = 0; n < mesh_.nodes_per_element; ++n)
          append_text(text_, ",{}", mesh_.element(e)[n] + 1);
        text_ += '\n';
      }
    }
    for (std::size_t p = 0; p < names_.parts.size(); ++p) {
      line("*ELSET, ELSET=E_{}", names_.parts[p]);
      for (std::size_t s = 0; s < mesh_.sections.size(); ++s)
        if (mesh_.sections[s].part == p) line("M_{}", section_name(s));
    }
  }

  [[nodiscard]] std::vector<std::uint32_t> nodes_of(const std::vector<ElementSide>& sides) const {
    std::vector<std::uint32_t> found;
    for (const ElementSide& at : sides) {
      const std::uint32_t* n = mesh_.element(at.element);
      if (mesh_.kind == AnalysisMesh::Kind::hexahedra)
        for (const std::uint8_t place : kHexahedronSides[at.side]) found.push_back(n[place]);
      else
        for (const std::uint8_t place : kTetrahedronSides[at.side]) found.push_back(n[place]);
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  void surface(const std::string& name, const std::vector<ElementSide>& sides) {
    line("*SURFACE, NAME=S_{}, TYPE=ELEMENT", name);
    for (const ElementSide& at : sides) line("{},S{}", at.element + 1, at.side + 1);
  }

  void faces() {
    const Surface& from = mesh_.body.surface;
    const std::vector<std::uint32_t> numbers = face_numbers(from);
    for (std::size_t f = 0; f < mesh_.sides.size(); ++f) {
      if (mesh_.sides[f].empty()) continue;
      comment(fmt::format("face {}/{}{}", from.parts[from.faces[f].part].name, numbers[f],
                          from.faces[f].name.empty() ? "" : ", called " + from.faces[f].name));
      line("*NSET, NSET=N_{}", names_.faces[f]);
      list(nodes_of(mesh_.sides[f]));
      surface(names_.faces[f], mesh_.sides[f]);
    }
  }

  void materials() {
    for (std::size_t s = 0; s < mesh_.sections.size(); ++s) {
      const MeshSection& section = mesh_.sections[s];
      const simulate::Material& material = analysis_.materials[section.part];
      comment(section.fill == 1 ? fmt::format("{}, {}", material.name, material.source)
                                : fmt::format("{} times {:.6g}, the mean fill of {} elements", material.name,
                                              section.fill, section.elements));
      line("*MATERIAL, NAME=MAT_{}", section_name(s));
      law(material, kStress * section.fill);
      line("*DENSITY\n{:.10g}", kDensity * section.fill * material.density);
      const bool turned = material.law == simulate::LawName::orthotropic;
      if (turned) {
        const Mat3& a = material.axes;
        line("*ORIENTATION, NAME=OR_{}, SYSTEM=RECTANGULAR\n{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g}",
             section_name(s), a(0, 0), a(1, 0), a(2, 0), a(0, 1), a(1, 1), a(2, 1));
      }
      line("*SOLID SECTION, ELSET=M_{0}, MATERIAL=MAT_{0}{1}", section_name(s),
           turned ? ", ORIENTATION=OR_" + section_name(s) : "");
    }
  }

  // The elastic constants, moduli times `unit`.
  void law(const simulate::Material& m, double unit) {
    const Vec3 e = unit * m.youngs, &nu = m.poissons, g = unit * m.shears;
    switch (m.law) {
      case simulate::LawName::neo_hooke:
        line("*ELASTIC\n{:.10g},{:.10g}", unit * m.young, m.poisson);
        return;
      case simulate::LawName::mooney_rivlin:  // D1 = 2 / K
        line("*HYPERELASTIC, MOONEY-RIVLIN\n{:.10g},{:.10g},{:.10g}", unit * m.c10, unit * m.c01,
             2 / (unit * m.bulk));
        return;
      case simulate::LawName::arruda_boyce:  // D = 2 / K
        line("*HYPERELASTIC, ARRUDA-BOYCE\n{:.10g},{:.10g},{:.10g}", unit * m.chain_mu, m.lambda_m,
             2 / (unit * m.bulk));
        return;
      case simulate::LawName::orthotropic:
        line(
            "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},"
            "{:.10g}\n{:.10g}",
            e[0], e[1], e[2], nu[0], nu[1], nu[2], g[0], g[1], g[2]);
        return;
    }
  }

  void supports() {
    std::size_t next = 0;
    for (std::size_t i = 0; i < analysis_.supports.size(); ++i) {
      const AnalysisSupport& support = analysis_.supports[i];
      comment(fmt::format(
          "{} {}: {} nodes held{}", support.is_move ? "move" : "fix", support.name, support.nodes.size(),
          support.equations.empty() ? ""
                                    : fmt::format(", {} equations where the face cuts through elements",
                                                  support.equations.size())));
      if (!support.nodes.empty()) {
        line("*NSET, NSET=N_{}", names_.supports[i]);
        list(support.nodes);
      }
      for (const NodeEquation& equation : support.equations) {
        const bool constant = equation.value != 0;
        line("*EQUATION\n{}\n{},{},{:.10g}\n{},{},{:.10g}", constant ? 3 : 2, equation.first + 1,
             equation.axis + 1, equation.first_factor, equation.second + 1, equation.axis + 1,
             equation.second_factor);
        if (constant) line("{},{},{:.10g}", aside_[next++] + 1, equation.axis + 1, -1.0);
      }
    }
    line("*BOUNDARY");
    for (const AnalysisSupport& support : analysis_.supports)
      if (!support.is_move)
        for (const HeldAxis& held : support.held)
          line("{},{},{}", held.node + 1, held.axis + 1, held.axis + 1);
  }

  // Prescribed displacements: within the step.
  void moves() {
    std::string led;
    std::size_t next = 0;
    for (const AnalysisSupport& support : analysis_.supports) {
      if (support.is_move)
        for (const HeldAxis& held : support.held)
          led += fmt::format("{},{},{},{:.10g}\n", held.node + 1, held.axis + 1, held.axis + 1,
                             kLength * held.value);
      for (const NodeEquation& equation : support.equations) {
        if (equation.value == 0) continue;
        for (std::uint32_t axis = 0; axis < 3; ++axis)
          led += fmt::format("{},{},{},{:.10g}\n", aside_[next] + 1, axis + 1, axis + 1,
                             axis == equation.axis ? kLength * equation.value : 0);
        ++next;
      }
    }
    if (!led.empty()) text_ += "*BOUNDARY\n" + led;
  }

  void ties() {
    for (std::size_t i = 0; i < analysis_.ties.size(); ++i) {
      const TiedFaces& tie = analysis_.ties[i];
      comment(fmt::format("parts {} and {} touch and are bonded", mesh_.body.parts[tie.part[0]].name,
                          mesh_.body.parts[tie.part[1]].name));
      std::array<std::string, 2> names;
      for (std::size_t side = 0; side < 2; ++side) {
        names[side] = fmt::format("BOND_{}_{}", i + 1, side == 0 ? "SLAVE" : "MASTER");
        std::vector<ElementSide> sides;
        for (const std::uint32_t f : tie.faces[side])
          sides.insert(sides.end(), mesh_.sides[f].begin(), mesh_.sides[f].end());
        surface(names[side], sides);
      }
      line("*TIE, NAME=BOND_{}, POSITION TOLERANCE={:.6g}\nS_{},S_{}", i + 1, kLength * tie.tolerance,
           names[0], names[1]);
    }
  }

  void probes() {
    for (std::size_t i = 0; i < analysis_.probes.size(); ++i) {
      const AnalysisProbe& probe = analysis_.probes[i];
      comment(fmt::format("probe {}: {}", probe.name,
                          probe.weights.size() == 1
                              ? fmt::format("the nearest node, {:.3g} mm away", kLength * probe.distance)
                              : fmt::format("the weighted mean over {} nodes; --summary has the weights",
                                            probe.weights.size())));
      std::vector<std::uint32_t> nodes;
      for (const auto& [node, weight] : probe.weights) nodes.push_back(node);
      std::sort(nodes.begin(), nodes.end());
      nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
      line("*NSET, NSET=N_{}", names_.probes[i]);
      list(nodes);
    }
  }

  void step() {
    const double first = analysis_.large_deflection ? std::min(0.2, 1.0 / analysis_.load_steps) : 1;
    line("*STEP{}\n*STATIC", analysis_.large_deflection ? ", NLGEOM, INC=1000" : "");
    line("{:.6g},1,1e-5,{:.6g}", first, analysis_.large_deflection ? 0.25 : 1);
    moves();
    for (std::size_t i = 0; i < analysis_.loads.size(); ++i) {
      const AnalysisLoad& load = analysis_.loads[i];
      comment(fmt::format("load {}: {}, in total ({:.6g}, {:.6g}, {:.6g}) N", load.name, load.kind,
                          load.total.x(), load.total.y(), load.total.z()));
      line("*CLOAD");
      for (const auto& [node, force] : load.forces)
        for (int axis = 0; axis < 3; ++axis)
          if (force[axis] != 0) line("{},{},{:.10g}", node + 1, axis + 1, force[axis]);
    }
    if (analysis_.gravity) {
      const Vec3& g = *analysis_.gravity;
      const double size = g.norm();
      line("*DLOAD");
      for (const std::string& part : names_.parts)
        line("E_{},GRAV,{:.10g},{:.10g},{:.10g},{:.10g}", part, kLength * size, size > 0 ? g.x() / size : 0,
             size > 0 ? g.y() / size : 0, size > 0 ? g.z() / size : -1);
    }
    line("*NODE FILE\nU,RF\n*EL FILE\nS,E");
    for (std::size_t i = 0; i < analysis_.supports.size(); ++i)
      if (!analysis_.supports[i].nodes.empty())
        line("*NODE PRINT, NSET=N_{}, TOTALS=ONLY\nRF", names_.supports[i]);
    for (const std::string& probe : names_.probes) line("*NODE PRINT, NSET=N_{}\nU", probe);
    line("*END STEP");
  }

  const Analysis& analysis_;
  const AnalysisMesh& mesh_;
  const CalculixOptions& options_;
  CalculixNames names_;
  std::vector<std::uint32_t> aside_;
  std::string text_;
};

}  // namespace

CalculixNames calculix_names(const Analysis& analysis) {
  const Surface& surface = analysis.mesh.body.surface;
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  CalculixNames names;
  Names unique;
  for (const Part& part : analysis.mesh.body.parts) names.parts.push_back(unique(part.name));
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    names.faces.push_back(
        unique(fmt::format("{}_{}", surface.parts[surface.faces[f].part].name, numbers[f])));
  for (std::size_t i = 0; i < analysis.supports.size(); ++i)
    names.supports.push_back(unique(fmt::format("{}_{}_{}", analysis.supports[i].is_move ? "MOVE" : "FIX",
                                                i + 1, analysis.supports[i].name)));
  for (const AnalysisLoad& load : analysis.loads) names.loads.push_back(unique("LOAD_" + load.name));
  for (const AnalysisProbe& probe : analysis.probes) names.probes.push_back(unique("PROBE_" + probe.name));
  return names;
}

std::string calculix_file(const Analysis& analysis, const CalculixOptions& options) {
  return Writer(analysis, options)();
}

}  // namespace flexel::mesh_export
