// A face around a whole period gets exactly one, from the place where its seam is.
#include "cad/deform/face_domain.h"

#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Geom_Surface.hxx>
#include <Precision.hxx>
#include <algorithm>
#include <cmath>

namespace flexel::cad {
namespace {

struct Direction {
  double begin = 0, end = 0;          // of the face
  double own_begin = 0, own_end = 0;  // of the surface
  double period = 0;                  // 0: none
  bool closed = false;                // the surface meets itself at its bounds
};

// Returns whether the face goes all around.
bool settle(Direction& d) {
  if (d.period > 0) {
    if (std::fabs(d.end - d.begin - d.period) >= 1e-6 * d.period) return false;
    const double quarter = d.period / 4;
    const double seam = d.own_begin + quarter * std::round((d.begin - d.own_begin) / quarter);
    d.begin = std::fabs(seam - d.begin) < 1e-6 * d.period ? seam : 0.5 * (d.begin + d.end - d.period);
    d.end = d.begin + d.period;
    return true;
  }
  const double near = 1e-7 * std::max(1.0, std::fabs(d.end - d.begin));
  const bool from_begin = !Precision::IsInfinite(d.own_begin) && d.begin < d.own_begin + near;
  const bool to_end = !Precision::IsInfinite(d.own_end) && d.end > d.own_end - near;
  if (from_begin) d.begin = d.own_begin;
  if (to_end) d.end = d.own_end;
  return d.closed && from_begin && to_end;
}

}  // namespace

FaceDomain face_domain(const TopoDS_Face& face) {
  const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
  Direction u, v;
  BRepTools::UVBounds(face, u.begin, u.end, v.begin, v.end);
  surface->Bounds(u.own_begin, u.own_end, v.own_begin, v.own_end);
  if (surface->IsUPeriodic()) u.period = surface->UPeriod();
  if (surface->IsVPeriodic()) v.period = surface->VPeriod();
  u.closed = surface->IsUClosed();
  v.closed = surface->IsVClosed();
  FaceDomain domain;
  domain.u_closed = settle(u);
  domain.v_closed = settle(v);
  domain.u_begin = u.begin;
  domain.u_end = u.end;
  domain.v_begin = v.begin;
  domain.v_end = v.end;
  return domain;
}

double length_of(const Handle(Geom_Surface) & surface, const FaceDomain& d, bool along_u) {
  constexpr int kPieces = 32;
  const auto at = [&](int i) {
    const double share = static_cast<double>(i) / kPieces;
    const double u = along_u ? d.u_begin + share * (d.u_end - d.u_begin) : 0.5 * (d.u_begin + d.u_end);
    const double v = along_u ? 0.5 * (d.v_begin + d.v_end) : d.v_begin + share * (d.v_end - d.v_begin);
    return surface->Value(u, v);
  };
  double length = 0;
  for (int i = 0; i < kPieces; ++i) length += at(i).Distance(at(i + 1));
  return length;
}

double length_of(const Handle(Geom_Curve) & curve, double begin, double end) {
  constexpr int kPieces = 64;
  double length = 0;
  for (int i = 0; i < kPieces; ++i)
    length += curve->Value(begin + (end - begin) * i / kPieces)
                  .Distance(curve->Value(begin + (end - begin) * (i + 1) / kPieces));
  return length;
}

namespace {

constexpr std::size_t kRaster = 96;  // cells in each direction

}  // namespace

// A cell is whole where its middle and those of the eight cells around it are on one side; edges that pass between these
// middles and touch none of the nine cells' are thinner than a cell, and a hole so small is not left out of a fit.
FaceMask::FaceMask(const TopoDS_Face& face, const FaceDomain& domain)
    : domain_(domain), classifier_(face, 1e-6), cells_(kRaster * kRaster, Cell::rim) {
  std::vector<std::uint8_t> inside(kRaster * kRaster);
  for (std::size_t j = 0; j < kRaster; ++j)
    for (std::size_t i = 0; i < kRaster; ++i) {
      const double u =
          domain.u_begin + (domain.u_end - domain.u_begin) * (static_cast<double>(i) + 0.5) / kRaster;
      const double v =
          domain.v_begin + (domain.v_end - domain.v_begin) * (static_cast<double>(j) + 0.5) / kRaster;
      inside[i + kRaster * j] = classifier_.Perform(gp_Pnt2d(u, v)) != TopAbs_OUT;
    }
  for (std::size_t j = 1; j + 1 < kRaster; ++j)
    for (std::size_t i = 1; i + 1 < kRaster; ++i) {
      std::size_t count = 0;
      for (std::size_t b = j - 1; b <= j + 1; ++b)
        for (std::size_t a = i - 1; a <= i + 1; ++a) count += inside[a + kRaster * b];
      if (count == 9) cells_[i + kRaster * j] = Cell::inside;
      if (count == 0) cells_[i + kRaster * j] = Cell::outside;
    }
}

bool FaceMask::has(double u, double v) const {
  const auto cell = [](double at, double begin, double end) {
    const double place = std::floor((at - begin) / (end - begin) * static_cast<double>(kRaster));
    return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(kRaster - 1)));
  };
  const Cell found =
      cells_[cell(u, domain_.u_begin, domain_.u_end) + kRaster * cell(v, domain_.v_begin, domain_.v_end)];
  if (found != Cell::rim) return found == Cell::inside;
  return classifier_.Perform(gp_Pnt2d(u, v)) != TopAbs_OUT;
}

bool FaceMask::has_near(double u, double v, double du, double dv) const {
  if (has(u, v)) return true;
  for (int b = -1; b <= 1; ++b)
    for (int a = -1; a <= 1; ++a)
      if ((a != 0 || b != 0) && has(std::clamp(u + a * du, domain_.u_begin, domain_.u_end),
                                    std::clamp(v + b * dv, domain_.v_begin, domain_.v_end)))
        return true;
  return false;
}

}  // namespace flexel::cad
