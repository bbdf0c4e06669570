// The rectangle of parameters that a face needs of its surface, and what of it lies in the face.
#pragma once
#include <BRepTopAdaptor_FClass2d.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <TopoDS_Face.hxx>
#include <cstdint>
#include <vector>

namespace flexel::cad {

struct FaceDomain {
  double u_begin = 0, u_end = 0, v_begin = 0, v_end = 0;
  bool u_closed = false, v_closed = false;  // the surface meets itself: one whole period
};

// What the face's edges bound, a little more where that is the surface's own bound.
[[nodiscard]] FaceDomain face_domain(const TopoDS_Face& face);

// Of the line of parameters through the middle of the domain, and of a curve.
[[nodiscard]] double length_of(const Handle(Geom_Surface) & surface, const FaceDomain& domain, bool along_u);
[[nodiscard]] double length_of(const Handle(Geom_Curve) & curve, double begin, double end);

// Which parameters lie in the face: where errors of a fit count. What its edges pass by is looked up exactly, the rest in
// a raster.
class FaceMask {
 public:
  FaceMask(const TopoDS_Face& face, const FaceDomain& domain);
  [[nodiscard]] bool has(double u, double v) const;
  // Whether one of nine points is in the face: (u, v) and those `du` and `dv` beside it.
  [[nodiscard]] bool has_near(double u, double v, double du, double dv) const;

 private:
  enum class Cell : std::uint8_t { outside, rim, inside };
  FaceDomain domain_;
  mutable BRepTopAdaptor_FClass2d classifier_;
  std::vector<Cell> cells_;
};

}  // namespace flexel::cad
