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

FaceMask::Raster::Raster(std::size_t cells) : n(cells), known(cells * cells) {}

FaceMask::FaceMask(const TopoDS_Face& face, const FaceDomain& domain)
    : domain_(domain), classifier_(face, 1e-6), coarse_(96), fine_(8 * coarse_.n) {}

// Whether the middle of a cell is in the face.
bool FaceMask::middle(Raster& raster, std::size_t i, std::size_t j) const {
  Known& cell = raster.known[i + raster.n * j];
  if (cell == Known::not_yet) {
    const auto at = [&](std::size_t k, double begin, double end) {
      return begin + (end - begin) * (static_cast<double>(k) + 0.5) / static_cast<double>(raster.n);
    };
    const gp_Pnt2d uv(at(i, domain_.u_begin, domain_.u_end), at(j, domain_.v_begin, domain_.v_end));
    cell = classifier_.Perform(uv) != TopAbs_OUT ? Known::inside : Known::outside;
  }
  return cell == Known::inside;
}

// A coarse cell is in the face where its middle and those of the eight cells around it are: a hole that passes between
// these middles is thinner than a cell, and one so small is not left out of a fit. The converse does not hold: a rib
// between nine middles outside belongs to the face.
bool FaceMask::has(double u, double v) const {
  const auto cell = [](double at, double begin, double end, const Raster& raster) {
    const double place = std::floor((at - begin) / (end - begin) * static_cast<double>(raster.n));
    return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(raster.n - 1)));
  };
  const std::size_t i = cell(u, domain_.u_begin, domain_.u_end, coarse_),
                    j = cell(v, domain_.v_begin, domain_.v_end, coarse_);
  bool whole = i > 0 && j > 0 && i + 1 < coarse_.n && j + 1 < coarse_.n && middle(coarse_, i, j);
  for (std::size_t k = 0; whole && k < 9; ++k) whole = middle(coarse_, i + k % 3 - 1, j + k / 3 - 1);
  if (whole) return true;
  const std::size_t p = cell(u, domain_.u_begin, domain_.u_end, fine_),
                    q = cell(v, domain_.v_begin, domain_.v_end, fine_);
  // The face's edges run along the rim of its domain, and arms of it may be thinner there than any cell.
  if (p == 0 || p + 1 == fine_.n) return on_rim(u, v, p == 0 ? 0 : 1);
  if (q == 0 || q + 1 == fine_.n) return on_rim(u, v, q == 0 ? 2 : 3);
  return middle(fine_, p, q);
}

std::size_t FaceMask::RimHash::operator()(const RimPlace& place) const {
  return std::hash<double>()(place.across) * 31 + 4 * std::size_t{place.along} + place.side;
}

// `side`: u_begin, u_end, v_begin, v_end.
bool FaceMask::on_rim(double u, double v, std::uint32_t side) const {
  constexpr double kCells = 12288;
  const double along = side < 2 ? (v - domain_.v_begin) / (domain_.v_end - domain_.v_begin)
                                : (u - domain_.u_begin) / (domain_.u_end - domain_.u_begin);
  const RimPlace place{side, static_cast<std::uint32_t>(std::clamp(along, 0.0, 1.0) * kCells),
                       side < 2 ? u : v};
  const auto [found, is_new] = rim_.try_emplace(place, false);
  if (is_new) found->second = classifier_.Perform(gp_Pnt2d(u, v)) != TopAbs_OUT;
  return found->second;
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
