// The library of materials. Sources, by key:
//   EN1993 EN 1993-1-1:2005 3.2.6 (E, nu of structural steel); density EN 1991-1-1 table A.4
//   EN1993-4 EN 1993-1-4:2006 2.1.3 (stainless steel 1.4301); density EN 10088-1
//   MIL5J MIL-HDBK-5J (2003), tables 3.6.2 (6061-T6) and 5.4.1 (Ti-6Al-4V)
//   CDA Copper Development Association, data sheets C36000 and C11000
//   MFR typical value of manufacturers' data sheets (Ultimaker PLA, ABS, PETG: tensile modulus XY by ISO 527;
//   EOS PA 2200;
//       Covestro Makrolon 2405; Delrin 500P; BASF Elastollan 1185A)
//   GENT Gent, "On the relation between indentation hardness and Young's modulus" (1958): 2.5 MPa at 50 Shore
//   A TRE Treloar, The Physics of Rubber Elasticity (1975): shear modulus near 0.4 MPa for vulcanised gum
//   rubber EN1992 EN 1992-1-1:2004 table 3.1 and 3.1.3 (C30/37, uncracked); density EN 1991-1-1 table A.1
//   (plain)
// Printed plastics: the figures are of dense, well printed matter; a sparse infill is softer.
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
    {"aluminum", "aluminium 6061"},
    {"aluminium", "aluminium 6061"},
    {"aluminum 6061", "aluminium 6061"},
    {"stainless steel", "stainless"},
    {"1.4301", "stainless"},
    {"304", "stainless"},
    {"ti6al4v", "titanium"},
    {"nylon", "PA12"},
    {"nylon PA12", "PA12"},
    {"PC", "polycarbonate"},
    {"delrin", "POM"},
    {"acetal", "POM"},
};

}  // namespace

const std::vector<Material>& material_library() {
  static const std::vector<Material> library = {
      {"steel", 210e9, 0.30, 7850, "EN 1993-1-1:2005, 3.2.6"},
      {"stainless", 200e9, 0.30, 7900, "EN 1993-1-4:2006, 2.1.3 (1.4301)"},
      {"aluminium 6061", 68.3e9, 0.33, 2700, "MIL-HDBK-5J, table 3.6.2 (6061-T6, 9.9e3 ksi)"},
      {"titanium", 110.3e9, 0.31, 4430, "MIL-HDBK-5J, table 5.4.1 (Ti-6Al-4V annealed, 16.0e3 ksi)"},
      {"brass", 97e9, 0.31, 8490, "CDA C36000 (modulus, density); nu from E and G = 37 GPa"},
      {"copper", 117e9, 0.34, 8910, "CDA C11000 (modulus, density); nu typical"},
      {"PLA", 3.25e9, 0.36, 1240, "Ultimaker PLA data sheet (ISO 527, XY); nu typical"},
      {"ABS", 2.1e9, 0.37, 1100, "Ultimaker ABS data sheet (ISO 527, XY); nu typical"},
      {"PETG", 1.9e9, 0.38, 1270, "Ultimaker PETG data sheet (ISO 527, XY); nu typical"},
      {"PA12", 1.65e9, 0.39, 930, "EOS PA 2200 data sheet (ISO 527); nu typical"},
      {"polycarbonate", 2.4e9, 0.38, 1200, "Covestro Makrolon 2405 data sheet (ISO 527); nu typical"},
      {"POM", 3.1e9, 0.37, 1420, "Delrin 500P data sheet (ISO 527); nu typical"},
      {"rubber", 1.2e6, 0.49, 930, "Treloar 1975: G near 0.4 MPa; nearly incompressible, nu taken as 0.49"},
      {"silicone", 2.5e6, 0.48, 1150,
       "Gent 1958 relation at 50 Shore A; nearly incompressible, nu taken as 0.48"},
      {"TPU", 20e6, 0.45, 1120, "typical of 85 Shore A at small strain (Elastollan 1185A); nu taken as 0.45"},
      {"concrete", 33e9, 0.20, 2400, "EN 1992-1-1:2004, table 3.1 (C30/37)"},
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
