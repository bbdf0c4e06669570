// The library of materials. Each source says where its figures were read; what follows "not read" is named
// from general knowledge, and nobody has looked it up there. Strengths are the least that the standard
// demands of the grade and size in the source, or typical where it says so.
#include "simulate/input/materials.h"

#include <cctype>
#include <utility>

#include "simulate/input/material_names.h"

namespace flexel::simulate {
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
    {"MJF PA12", "PA12 MJF"},
    {"nylon MJF", "PA12 MJF"},
    {"nylon PA12", "PA12"},
    {"PC", "polycarbonate"},
    {"delrin", "POM"},
    {"acetal", "POM"},
    {"acrylic", "PMMA"},
    {"plexiglas", "PMMA"},
    {"aluminum oxide", "alumina"},
};

// Yield and tensile strength [Pa], elongation, tensile strength across the layers of a print [Pa]; 0: not
// given.
struct Strength {
  double yield = 0, strength = 0, elongation = 0, across_layers = 0;
};

Material library_entry(const char* name, double young, double poisson, double density,
                       const Strength& strength, const char* source) {
  Material material;
  material.name = name;
  material.young = young;
  material.poisson = poisson;
  material.density = density;
  material.yield = strength.yield;
  material.strength = strength.strength;
  material.elongation = strength.elongation;
  material.layer_strength = strength.across_layers;
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

// Made before main(): a table, by kind.
const Material kLibrary[] = {
    with_damping(
        with_friction(
            library_entry("steel", 210e9, 0.30, 7850, {235e6, 360e6, 0.26},
                          "S235JR. EN 1993-1-1, 3.2.6, read at eurocodeapplied.com, strengths EN 10025-2 "
                          "(3 to 16 mm) at ilongma.com, friction EN 1090-2, table 18, class D, at "
                          "scribd.com; not read: damping EN 1991-1-4, F.2 (welded stack, 0.012 / 2 pi; "
                          "help.scia.net has the prestandard's 0.015)"),
            0.2),
        0.0019),
    with_friction(library_entry("steel S355", 210e9, 0.30, 7850, {355e6, 470e6, 0.22},
                                "S355JR. As steel; strengths EN 10025-2 (3 to 16 mm), read at "
                                "balingsteel.com, friction EN 1090-2, table 18, class D, at scribd.com"),
                  0.2),
    library_entry(
        "steel 42CrMo4", 210e9, 0.30, 7850, {900e6, 1100e6, 0.10},
        "Quenched and tempered, to 16 mm. Strengths EN 10083, read in Saarstahl's data sheet; elastic "
        "figures as steel"),
    library_entry("spring steel", 206e9, 0.264, 7850, {},
                  "EN 10270-1 (E 206, G 81.5 GPa, hence poisson), read at mollificiomodenese.it"),
    library_entry(
        "stainless", 200e9, 0.30, 7900, {210e6, 520e6, 0.45},
        "1.4301, plate. E, poisson (from G 77 GPa) read at makeitfrom.com, least strengths, elongation "
        "(hot rolled) at wixsteel.com, density at agst.de"),
    library_entry("stainless 316", 200e9, 0.30, 8000, {220e6, 520e6, 0.40},
                  "1.4401. E read at woite-edelstahl.com, density and least strengths at metalsupplies.com "
                  "(there 193 GPa); poisson as 1.4301"),
    library_entry("cast iron", 110e9, 0.26, 7200, {0, 250e6, 0},
                  "EN-GJL-250. EN 1561 (E 103 to 118 GPa), read at sn-castiron.nl"),
    library_entry("ductile iron", 169e9, 0.28, 7100, {250e6, 400e6, 0.15},
                  "EN-GJS-400-15. EN 1563, read at iron-foundry.com, poisson at sn-castiron.nl"),
    library_entry(
        "aluminium 6061", 68.9e9, 0.33, 2700, {241e6, 262e6, 0.10},
        "T6, extruded, from 6.4 mm. Strengths ASTM B221 (35, 38 ksi), read at h2abc.com; the others "
        "Aluminum Association, typical, at glemco.com (there strengths of 276 and 310 MPa, 12 %)"),
    library_entry("aluminium 6082", 70e9, 0.33, 2700, {250e6, 290e6, 0.08},
                  "T6. EN 755-2 (extruded, to 5 mm), read at top-factories.com, poisson (6000 series) at "
                  "mfgrobots.com"),
    library_entry("aluminium 5083", 71e9, 0.33, 2660, {125e6, 275e6, 0.11},
                  "O/H111. Strengths EN 485-2 (to 50 mm), read at euralliage.com; E, density (Aluminum "
                  "Association, typical), poisson (estimated) at ratnamsteels.com"),
    library_entry("aluminium 2024", 73.1e9, 0.33, 2780, {345e6, 483e6, 0.18},
                  "T3, typical. E (10600 ksi) read at substech.com, density and strength at matweb.com, "
                  "yield and elongation at princeton.edu, poisson (T361) at makeitfrom.com"),
    library_entry(
        "aluminium 7075", 71.7e9, 0.33, 2810, {503e6, 572e6, 0.11},
        "T6, typical. E (10400 ksi), density, strengths read at substech.com, poisson at wikipedia.org"),
    library_entry(
        "titanium", 113.8e9, 0.33, 4430, {827e6, 896e6, 0.10},
        "Ti-6Al-4V annealed. E (16500 ksi), poisson, density read at asm.matweb.com, least strengths "
        "(120, 130 ksi) at nickel-systems.com"),
    library_entry("magnesium", 45e9, 0.35, 1770, {}, "AZ31B, read at alloysintl.com"),
    library_entry(
        "nickel alloy 718", 200e9, 0.29, 8220, {1034e6, 1276e6, 0.12},
        "Aged. E (29.0e3 ksi), poisson read in Special Metals SMC-045, density at hightempmetals.com; "
        "not read: strengths AMS 5663"),
    library_entry("brass", 97e9, 0.31, 8490, {}, "C36000, read at ezlok.com"),
    library_entry(
        "copper", 117e9, 0.34, 8910, {},
        "C11000. E (17.0e3 ksi), density read in Hussey Copper's data sheet, poisson at shlionmetal.com"),
    library_entry("bronze", 110e9, 0.34, 8860, {},
                  "C51000. E, density read in Olin Brass's data sheet, poisson at makeitfrom.com"),
    library_entry("tungsten", 411e9, 0.28, 19300, {},
                  "Pure. CRC Handbook and Cardarelli 2018, read at matmake.com"),
    library_entry("PLA", 3.25e9, 0.36, 1240, {45e6, 48e6, 0.025, 26e6},
                  "Printed. E (data sheets' example) read at filamentspecs.com, poisson, density in "
                  "FreeCAD's library, strengths, elongation in Stratasys's data sheet (ASTM D638; E 3.04 "
                  "GPa, 2.54 across layers) at pro3dcomposites.com (additive.tools has 50 to 65 MPa, 35 to "
                  "45 across layers)"),
    library_entry("PETG", 1.94e9, 0.38, 1270, {0, 44e6, 0, 25e6},
                  "Printed. E (data sheets' example) read at filamentspecs.com, density in UltiMaker's "
                  "fdm_materials (github.com), strengths (least of 44 to 56 and 25 to 38 MPa) at "
                  "additive.tools; not read: poisson"),
    library_entry("ABS", 2.0e9, 0.37, 1040, {0, 33e6, 0.046},
                  "Printed. E, density SUSTAABS data sheet (ISO 527; molded it yields at 38 MPa), read at "
                  "studylib.net, poisson in FreeCAD's library (0.394 at "
                  "themechanicalengineeringhandbook.com), strength Stratasys ABS-M30 (ISO 527, by "
                  "Loughborough University; 36 MPa by ASTM D638) at pdfslide.net, elongation (UltiMaker) "
                  "at github.com"),
    library_entry("ASA", 2.0e9, 0.37, 1070, {0, 35e6, 0},
                  "Molded. E, density, strength (least of 2.0 to 2.5 GPa and 35 to 50 MPa), read at "
                  "renato.design (Polymaker's, printed, has 43.8 MPa at github.com); poisson taken as "
                  "ABS"),
    library_entry(
        "PA12", 1.65e9, 0.408, 930, {0, 48e6, 0.18},
        "Laser sintered, EOS PA 2200. Strength, elongation read at layerx3d.in, density at additive.tools, "
        "poisson (Duraform PA, dense) at nowpublishers.com (Rapid Prototyping J. 14/5); not read: E "
        "(renato.design has 1.7 to 1.9 GPa)"),
    library_entry("PA12 MJF", 1.8e9, 0.43, 1010, {0, 48e6, 0.12, 48e6},
                  "Multi Jet Fusion, HP 3D High Reusability PA 12. HP's data sheet (ASTM D638, least of XY "
                  "and Z), read at scribd.com"),
    library_entry("durable resin", 1.26e9, 0.40, 1150, {0, 31.8e6, 0.49},
                  "Stereolithography, Formlabs Durable, cured. Formlabs's data sheet (ASTM D638), read at "
                  "manualmachine.com, density (of cured resins) at renato.design; poisson taken as 0.40"),
    library_entry("polycarbonate", 2.4e9, 0.37, 1200, {65e6, 0, 0},
                  "Makrolon 2405. Covestro's data sheet (ISO 527), read at scribd.com, poisson at "
                  "themechanicalengineeringhandbook.com"),
    library_entry("POM", 3.1e9, 0.37, 1420, {70e6, 0, 0},
                  "Delrin 500P. DuPont's figures (ISO 527), read at a dealer's (zjxxg.cn), poisson "
                  "(MatWeb's) in FreeCAD's library"),
    library_entry("PMMA", 2.86e9, 0.38, 1190, {0, 75e6, 0.045},
                  "Cast; read at designerdata.nl, poisson (MatWeb's) in FreeCAD's library"),
    library_entry("PEEK", 4.2e9, 0.40, 1310, {116e6, 116e6, 0.15},
                  "TECAPEEK natural. Ensinger's data sheet (ISO 527), quoted, read at github.com "
                  "(TempestOS-Core); not read: poisson"),
    library_entry(
        "rubber", 1.2e6, 0.49, 930, {},
        "Natural, soft. E chosen in the range 1 to 5 MPa, read at polymers.netzsch.com (matweb.com has G "
        "0.5 MPa), density at thermopedia.com; nearly incompressible, poisson taken as 0.49"),
    library_entry(
        "silicone", 2.5e6, 0.48, 1170, {},
        "Gent 1958's relation at 50 Shore A, computed (Ruess's, read at josephborrello.com, gives 3.4 "
        "MPa); density (Silastic 55U) read at archive.org; nearly incompressible, poisson taken as 0.48"),
    library_entry(
        "TPU", 19.3e6, 0.45, 1180, {},
        "80 Shore A. BASF Elastollan C78A data sheet (E 2800 psi), read at scribd.com; poisson taken as "
        "0.45"),
    library_entry("TPU 86A", 60e6, 0.45, 1200, {0, 7e6, 0, 5e6},
                  "86 Shore A, laser sintered. E, strengths (ISO 527) read at shapeways.com, density "
                  "(printed TPU) at additive.tools; breaks at 250 %, 90 % across layers; poisson taken as "
                  "0.45"),
    with_damping(
        with_friction(
            library_entry(
                "concrete", 33e9, 0.20, 2400, {0, 2.9e6, 0},
                "C30/37. EN 1992-1-1, table 3.1 (strength: mean axial tension), read at "
                "buildinghow.com, poisson 3.1.3 in BHoM's datasets (github.com), density (C25) "
                "in FreeCAD's library; not read: friction EN 1992-1-1, 6.2.5 (smooth; hindawi.com has "
                "0.64), damping EN 1991-1-4, F.2 (building, 0.10 / 2 pi; help.scia.net has the "
                "prestandard's 0.08)"),
            0.6),
        0.016),
    library_entry("glass", 70e9, 0.20, 2500, {0, 45e6, 0},
                  "Soda lime, annealed. EN 572 (strength: in bending), read at vasglass.gr"),
    library_entry("borosilicate glass", 63e9, 0.20, 2230, {}, "ISO 3585, SCHOTT Duran, read at matmatch.com"),
    library_entry("alumina", 370e9, 0.22, 3900, {}, "99.5 %, read at vertebr.ae"),
};

struct LibraryHardening {
  const char* name;
  double uniform_elongation;  // 0: linear hardening instead
  double hardening;           // Pa
  const char* source;
};

// Uniform elongations by formulas for the kind of metal, of the row's own yield stress and strength; not more than the
// row's elongation at break.
const LibraryHardening kLibraryHardening[] = {
    {"steel", 0.208, 0, "not read: Yun and Gardner 2017, 0.6 (1 - yield / strength)"},
    {"steel S355", 0.147, 0, "not read: Yun and Gardner 2017, 0.6 (1 - yield / strength)"},
    {"steel 42CrMo4", 0.06, 0, "not read: the least of Yun and Gardner 2017"},
    {"stainless", 0.45, 0, "the elongation; not read: Rasmussen 2003, 1 - yield / strength, has 59.6 %"},
    {"stainless 316", 0.40, 0, "the elongation; not read: Rasmussen 2003, 1 - yield / strength, has 57.7 %"},
    {"ductile iron", 0.15, 0, "the elongation, for it hardly necks (not read)"},
    {"aluminium 6061", 0.069, 0, "not read: Su, Young and Gardner 2016, 0.13 (1 - yield / strength) + 0.059"},
    {"aluminium 6082", 0.077, 0, "not read: Su, Young and Gardner 2016, 0.13 (1 - yield / strength) + 0.059"},
    {"aluminium 5083", 0.11, 0,
     "the elongation; not read: Su, Young and Gardner 2016, 0.13 (1 - yield / strength) + 0.059, has 13 %"},
    {"aluminium 2024", 0.096, 0, "not read: Su, Young and Gardner 2016, 0.13 (1 - yield / strength) + 0.059"},
    {"aluminium 7075", 0.075, 0, "not read: Su, Young and Gardner 2016, 0.13 (1 - yield / strength) + 0.059"},
    {"titanium", 0.077, 0, "computed: Hollomon's power law through yield and strength"},
    {"nickel alloy 718", 0.12, 0,
     "the elongation; computed: Hollomon's power law through yield and strength has 12.4 %"},
    {"polycarbonate", 0, 78e6,
     "3 G, G 26 MPa by Tervoort and Govaert 2000, read at research.tue.nl; it softens first, which is left "
     "out"},
};

// Gives a material of the library its uniform elongation or its hardening, and the source of it.
void add_library_hardening(Material& material) {
  for (const LibraryHardening& each : kLibraryHardening) {
    if (material.name != each.name) continue;
    material.uniform_elongation = each.uniform_elongation;
    material.hardening = each.hardening;
    material.source += each.uniform_elongation > 0 ? "; uniform elongation: " : "; hardening: ";
    material.source += each.source;
  }
}

}  // namespace

const std::vector<Material>& material_library() {
  static const std::vector<Material> library = [] {
    std::vector<Material> made(std::begin(kLibrary), std::end(kLibrary));
    for (Material& material : made) add_library_hardening(material);
    return made;
  }();
  return library;
}

bool same_material_name(const std::string& one, const std::string& other) {
  return folded(one) == folded(other);
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

Mat6 compliance(const Material& material) {
  Mat6 c = Mat6::Zero();
  const Vec3 &e = material.youngs, &nu = material.poissons, &g = material.shears;
  for (int i = 0; i < 3; ++i) c(i, i) = 1 / e[i];
  c(0, 1) = c(1, 0) = -nu[0] / e[0];
  c(0, 2) = c(2, 0) = -nu[1] / e[0];
  c(1, 2) = c(2, 1) = -nu[2] / e[1];
  c.diagonal().tail<3>() << 1 / g[0], 1 / g[2], 1 / g[1];  // xy, yz, zx
  return c;
}

Law law_of(const Material& material, const Mat3& frame) {
  switch (material.law) {
    case LawName::neo_hooke:
      return neo_hooke_law(shear_modulus(material), lame_lambda(material));
    case LawName::mooney_rivlin:
      return mooney_rivlin_law(material.c10, material.c01, material.bulk);
    case LawName::arruda_boyce:
      return arruda_boyce_law(material.chain_mu, material.lambda_m, material.bulk);
    case LawName::orthotropic:
      return orthotropic_law(compliance(material), frame.transpose() * material.axes);
  }
  return {};
}

void set_isotropic_constants(Material& material) {
  if (material.law == LawName::neo_hooke) return;
  const Law law = law_of(material);
  material.young = law.mu * (3 * law.lambda + 2 * law.mu) / (law.lambda + law.mu);
  material.poisson = law.lambda / (2 * (law.lambda + law.mu));
}

const char* law_name(LawName law) {
  switch (law) {
    case LawName::neo_hooke:
      return "neo-hooke";
    case LawName::mooney_rivlin:
      return "mooney-rivlin";
    case LawName::arruda_boyce:
      return "arruda-boyce";
    case LawName::orthotropic:
      return "orthotropic";
  }
  return "";
}

}  // namespace flexel::simulate
