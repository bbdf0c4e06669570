// The library of materials. A figure stands here only where its source gives it; "typical" marks those that
// sources agree on but no standard fixes. Strengths are the least that the standard demands, of the grade and
// size in the source.
#include "simulate/materials.h"

#include <cctype>
#include <utility>

namespace flexel {
namespace {

// Lower case without blanks, "-" and "_".
std::string folded(const std::string& name) {
  std::string result;
  for (const char letter : name)
    if (letter != ' ' && letter != '-' && letter != '_')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return result;
}

const std::vector<std::pair<const char*, const char*>> kAliases = {
    {"S235", "steel"},
    {"S355", "steel S355"},
    {"42CrMo4", "steel 42CrMo4"},
    {"4140", "steel 42CrMo4"},
    {"stainless steel", "stainless"},
    {"1.4301", "stainless"},
    {"304", "stainless"},
    {"1.4401", "stainless 316"},
    {"316", "stainless 316"},
    {"EN-GJL-250", "cast iron"},
    {"grey iron", "cast iron"},
    {"EN-GJS-400-15", "ductile iron"},
    {"aluminum", "aluminium 6061"},
    {"aluminium", "aluminium 6061"},
    {"aluminum 6061", "aluminium 6061"},
    {"aluminum 6082", "aluminium 6082"},
    {"aluminum 5083", "aluminium 5083"},
    {"aluminum 2024", "aluminium 2024"},
    {"aluminum 7075", "aluminium 7075"},
    {"ti6al4v", "titanium"},
    {"inconel 718", "nickel alloy 718"},
    {"AZ31B", "magnesium"},
    {"phosphor bronze", "bronze"},
    {"nylon", "PA12"},
    {"nylon PA12", "PA12"},
    {"PC", "polycarbonate"},
    {"delrin", "POM"},
    {"acetal", "POM"},
    {"acrylic", "PMMA"},
    {"plexiglas", "PMMA"},
    {"aluminum oxide", "alumina"},
};

// Yield and tensile strength [Pa], elongation; 0: not given.
struct Strength {
  double yield = 0, strength = 0, elongation = 0;
};

Material entry(const char* name, double young, double poisson, double density, const Strength& strength,
               const char* source) {
  Material material;
  material.name = name;
  material.young = young;
  material.poisson = poisson;
  material.density = density;
  material.yield = strength.yield;
  material.strength = strength.strength;
  material.elongation = strength.elongation;
  material.source = source;
  return material;
}

Material with_friction(Material material, double friction) {
  material.friction = friction;
  return material;
}

Material with_damping(Material material, double damping) {
  material.damping = damping;
  return material;
}

}  // namespace

const std::vector<Material>& material_library() {
  static const std::vector<Material> library = {
      with_damping(with_friction(entry("steel", 210e9, 0.30, 7850, {235e6, 360e6, 0.26},
                                       "S235JR. EN 1993-1-1:2005, 3.2.6; density EN 1991-1-1, A.4; strengths "
                                       "EN 10025-2 (3 to 16 mm); "
                                       "friction EN 1993-1-8, table 3.7, class D; damping EN 1991-1-4, F.2 "
                                       "(welded stack, 0.012 / 2 pi)"),
                                 0.2),
                   0.0019),
      with_friction(entry("steel S355", 210e9, 0.30, 7850, {355e6, 470e6, 0.22},
                          "S355JR. As steel; strengths EN 10025-2 (3 to 16 mm); friction EN 1993-1-8, table "
                          "3.7, class D"),
                    0.2),
      entry("steel 42CrMo4", 210e9, 0.30, 7850, {900e6, 1100e6, 0.10},
            "Quenched and tempered. Elastic figures as steel; strengths EN ISO 683-2 (to 16 mm)"),
      entry("spring steel", 206e9, 0.264, 7850, {}, "EN 13906-1 (E 206, G 81.5 GPa, hence poisson)"),
      entry(
          "stainless", 200e9, 0.30, 7900, {210e6, 520e6, 0.45},
          "1.4301. EN 1993-1-4:2006, 2.1.3 and table 2.1 (plate); density EN 10088-1; elongation EN 10088-2"),
      entry(
          "stainless 316", 200e9, 0.30, 8000, {220e6, 520e6, 0.45},
          "1.4401. EN 1993-1-4:2006, 2.1.3 and table 2.1 (plate); density EN 10088-1; elongation EN 10088-2"),
      entry("cast iron", 110e9, 0.26, 7200, {0, 250e6, 0},
            "EN-GJL-250. EN 1561, annex (E 103 to 118 GPa); strength EN 1561"),
      entry("ductile iron", 169e9, 0.275, 7100, {250e6, 400e6, 0.15}, "EN-GJS-400-15. EN 1563"),
      entry("aluminium 6061", 68.3e9, 0.33, 2700, {240e6, 290e6, 0.10},
            "T6. MIL-HDBK-5J, table 3.6.2 (9.9e3 ksi); strengths ASTM B209 (sheet)"),
      entry("aluminium 6082", 70e9, 0.30, 2700, {250e6, 290e6, 0.08},
            "T6. EN 1999-1-1, 3.2.5 and table 3.2b (extruded, to 5 mm)"),
      entry("aluminium 5083", 70e9, 0.30, 2700, {125e6, 275e6, 0.11},
            "O/H111. EN 1999-1-1, 3.2.5 and table 3.2a (to 50 mm)"),
      entry("aluminium 2024", 73.1e9, 0.33, 2780, {345e6, 483e6, 0.18}, "T3. Aluminum Association, typical"),
      entry("aluminium 7075", 71.7e9, 0.33, 2810, {503e6, 572e6, 0.11}, "T6. Aluminum Association, typical"),
      entry("titanium", 110.3e9, 0.31, 4430, {828e6, 895e6, 0.10},
            "Ti-6Al-4V annealed. MIL-HDBK-5J, table 5.4.1 (16.0e3 ksi); strengths ASTM B265, grade 5"),
      entry("magnesium", 44.8e9, 0.35, 1770, {}, "AZ31B. MIL-HDBK-5J, chapter 4 (6.5e3 ksi)"),
      entry("nickel alloy 718", 203e9, 0.29, 8220, {1034e6, 1276e6, 0.12},
            "Aged. MIL-HDBK-5J, chapter 6 (29.4e3 ksi); strengths AMS 5663"),
      entry("brass", 97e9, 0.31, 8490, {}, "CDA C36000 (modulus, density); poisson from E and G = 37 GPa"),
      entry("copper", 117e9, 0.34, 8910, {}, "CDA C11000 (modulus, density); poisson typical"),
      entry("bronze", 110e9, 0.34, 8860, {}, "CDA C51000 (16.0e3 ksi, density); poisson typical"),
      entry("tungsten", 411e9, 0.28, 19300, {}, "typical of pure tungsten"),
      entry("PLA", 3.25e9, 0.36, 1240, {}, "Ultimaker PLA data sheet (ISO 527, XY); poisson typical"),
      entry("ABS", 2.1e9, 0.37, 1100, {}, "Ultimaker ABS data sheet (ISO 527, XY); poisson typical"),
      entry("PETG", 1.9e9, 0.38, 1270, {}, "Ultimaker PETG data sheet (ISO 527, XY); poisson typical"),
      entry("PA12", 1.65e9, 0.39, 930, {0, 48e6, 0.18},
            "Laser sintered. EOS PA 2200 data sheet (ISO 527, XY); poisson typical"),
      entry("polycarbonate", 2.4e9, 0.38, 1200, {66e6, 0, 0},
            "Covestro Makrolon 2405 data sheet (ISO 527); poisson typical"),
      entry("POM", 3.1e9, 0.37, 1420, {}, "Delrin 500P data sheet (ISO 527); poisson typical"),
      entry("PMMA", 3.3e9, 0.37, 1190, {0, 80e6, 0.055}, "Plexiglas GS data sheet (ISO 527)"),
      entry("PEEK", 4.0e9, 0.40, 1300, {98e6, 0, 0.45}, "Victrex 450G data sheet (ISO 527); poisson typical"),
      entry("rubber", 1.2e6, 0.49, 930, {},
            "Treloar 1975: G near 0.4 MPa; nearly incompressible, poisson taken as 0.49"),
      entry("silicone", 2.5e6, 0.48, 1150, {},
            "Gent 1958 relation at 50 Shore A; nearly incompressible, poisson taken as 0.48"),
      entry("TPU", 20e6, 0.45, 1120, {},
            "typical of 85 Shore A at small strain (Elastollan 1185A); poisson taken as 0.45"),
      with_damping(
          with_friction(
              entry("concrete", 33e9, 0.20, 2400, {0, 2.9e6, 0},
                    "C30/37. EN 1992-1-1:2004, table 3.1 (strength: mean axial tension), 3.1.3; density EN "
                    "1991-1-1, A.1; friction EN 1992-1-1, 6.2.5 (smooth); damping EN 1991-1-4, F.2 "
                    "(building, 0.10 / 2 pi)"),
              0.6),
          0.016),
      entry("glass", 70e9, 0.20, 2500, {0, 45e6, 0},
            "Soda lime, annealed. EN 572-1 (strength: characteristic, in bending)"),
      entry("borosilicate glass", 64e9, 0.20, 2230, {}, "ISO 3585"),
      entry("alumina", 372e9, 0.22, 3900, {}, "99.5 %. CoorsTek AD-995 data sheet"),
  };
  return library;
}

const Material* library_material(const std::string& name) {
  std::string wanted = folded(name);
  for (const auto& [alias, meant] : kAliases)
    if (folded(alias) == wanted) {
      wanted = folded(meant);
      break;
    }
  for (const Material& material : material_library())
    if (folded(material.name) == wanted) return &material;
  return nullptr;
}

double lame_lambda(const Material& material) {
  return material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson));
}

double shear_modulus(const Material& material) {
  return material.young / (2 * (1 + material.poisson));
}

}  // namespace flexel
