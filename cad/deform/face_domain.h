// The rectangle of parameters that a face needs of its surface, and what of it lies in the face.
#pragma once
#include <BRepTopAdaptor_FClass2d.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <TopoDS_Face.hxx>
#include <cstdint>
#include <unordered_map>
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

// Which parameters lie in the face: where errors of a fit count. Looked up in rasters that are filled as they are asked:
// told to 1/768 of the domain, along its rim to 1/12288 and across it exactly; holes thinner than 1/96 may count as the
// face. A rib thinner than 1/768 may not be found: who judges a fit must not believe an "outside". One thread at a time.
class FaceMask {
 public:
  FaceMask(const TopoDS_Face& face, const FaceDomain& domain);
  [[nodiscard]] bool has(double u, double v) const;
  // Whether one of nine points is in the face: (u, v) and those `du` and `dv` beside it.
  [[nodiscard]] bool has_near(double u, double v, double du, double dv) const;

 private:
  enum class Known : std::uint8_t { not_yet, outside, inside };
  struct Raster {
    explicit Raster(std::size_t cells);
    std::size_t n;             // cells in each direction
    std::vector<Known> known;  // (n * n) of their middles
  };
  // Where along the rim, to 1/12288 of it, and how far from it, to the last digit.
  struct RimPlace {
    std::uint32_t side = 0, along = 0;
    double across = 0;
    bool operator==(const RimPlace&) const = default;
  };
  struct RimHash {
    std::size_t operator()(const RimPlace& place) const;
  };
  [[nodiscard]] bool middle(Raster& raster, std::size_t i, std::size_t j) const;
  [[nodiscard]] bool on_rim(double u, double v, std::uint32_t side) const;

  FaceDomain domain_;
  mutable BRepTopAdaptor_FClass2d classifier_;
  mutable Raster coarse_, fine_;
  mutable std::unordered_map<RimPlace, bool, RimHash> rim_;
};

}  // namespace flexel::cad
