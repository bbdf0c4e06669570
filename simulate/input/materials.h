// Materials: elastic constants and density, from a library of named ones or from the scene.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "simulate/laws/elasticity.h"

namespace flexel::simulate {

struct Material {
  std::string name;
  double young = 0;    // Pa
  double poisson = 0;  // in (-1, 0.5)
  double density = 0;  // kg/m^3
  std::string source;  // where the figures come from
  // Of [plasticity] and [fracture]; 0: not given
  double yield = 0, hardening = 0;  // Pa
  double strength = 0;              // Pa, largest principal stress
  double layer_strength = 0;        // Pa, of a print in tension across its layers; no effect takes it
  double elongation = 0;            // equivalent plastic strain at break
  // Engineering strain at the largest load of a bar, for Voce's law (simulate/input/hardening.h) in place of `hardening`
  double uniform_elongation = 0;
  // For people to choose from; no effect takes them by itself. 0: not given
  double friction = 0;                          // Coulomb's, against itself
  double damping = 0;                           // share of the critical
  std::optional<double> contact_friction = {};  // mu that a scene gives it, for [contact]
  // Of a print that is not solid (simulate/input/infill.h): the figures above are those of the print as a whole
  double infill = 1;  // share of the volume inside the walls
  double walls = 0;   // share of the part's volume
  // The elastic law (docs/theory/laws.md). Of others than neo-Hooke's `young` and `poisson` are those of the isotropic
  // material next to it at small strain, which penalties and bounds take.
  LawName law = LawName::neo_hooke;
  double c10 = 0, c01 = 0, bulk = 0;  // Pa, of Mooney and Rivlin; `bulk` of Arruda and Boyce too
  double chain_mu = 0, lambda_m = 0;  // of Arruda and Boyce: Pa; the stretch at which chains end
  // Orthotropic, in the axes of the material: E_1, E_2, E_3 [Pa]; nu_12, nu_13, nu_23; G_12, G_13, G_23 [Pa]
  Vec3 youngs = Vec3::Zero(), poissons = Vec3::Zero(), shears = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  // of the material in the part, columns, world frame
};

// The library, in order of docs/reference/materials.md. At room temperature; figures that are not known for certain are
// left out. A scene's own go before them.
[[nodiscard]] const std::vector<Material>& material_library();

// The library's material of that name or alias ("aluminum" = "aluminium 6061"; case, blanks, "-" and "_" do
// not matter); nothing when there is none.
[[nodiscard]] const Material* library_material(const std::string& name);

// Lame's first parameter and the shear modulus [Pa].
[[nodiscard]] double lame_lambda(const Material& material);
[[nodiscard]] double shear_modulus(const Material& material);

// The material's law for deformation gradients in the frame whose axes are the columns of `frame`.
[[nodiscard]] Law law_of(const Material& material, const Mat3& frame = Mat3::Identity());

// Of an orthotropic material, in its axes [1/Pa]: xx, yy, zz, xy, yz, zx, shears as angles.
[[nodiscard]] Mat6 compliance(const Material& material);

// Sets `young` and `poisson` from the constants of the law, where it is not neo-Hooke's.
void set_isotropic_constants(Material& material);

// What a scene calls a law.
[[nodiscard]] const char* law_name(LawName law);

}  // namespace flexel::simulate
