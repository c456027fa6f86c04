#include "assets/generator/meadow_terrain.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "assets/generator/noise.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

/// Grid lines from lo to hi: every cell near 0, wider apart farther out; lines between the cells' at the lane.
std::vector<double> grid_lines(double lo, double near_lo, double near_hi, double hi) {
  constexpr double kCell = MeadowTerrain::kCell;
  std::vector<double> lines;
  for (double at = near_lo; at <= near_hi; at += kCell) lines.push_back(at);
  for (double step = kCell, at = lines.back(); at < hi; step *= 1.12) lines.push_back(at += step);
  for (double step = kCell, at = near_lo; at > lo; step *= 1.12) lines.push_back(at -= step);
  std::sort(lines.begin(), lines.end());
  return lines;
}

/// Lines across the lane: its edges, and two ruts.
constexpr double kLaneLines[] = {0.35, 0.95, 2.05, 2.65};

std::string_view lane_material(double x) {
  if (x > kLaneLines[1] && x < kLaneLines[2]) return "lane_middle";
  return x < kLaneLines[0] || x > kLaneLines[3] ? "lane" : "lane_rut";
}

} // namespace

double MeadowTerrain::height(double x, double z) const {
  const double from_eye = std::sqrt(x * x + z * z);
  double y = 7.5 * fractal_noise({x * 0.013, 0.0, z * 0.013}, seed_ + 20, 3) * smooth_step(4.0, 70.0, from_eye);
  const double to_mill = std::sqrt((x - kMillPlace.x) * (x - kMillPlace.x) + (z - kMillPlace.z) * (z - kMillPlace.z));
  y += 7.5 * (1.0 - smooth_step(0.0, 72.0, to_mill));
  y += 20.0 * smooth_step(110.0, 300.0, z) + 13.0 * smooth_step(60.0, 260.0, std::abs(x));
  const double dip = (z - 34.0) / 24.0; // the lane goes down before it climbs to the mill
  return y - 2.6 / (1.0 + dip * dip);
}

DAffine MeadowTerrain::shear_to_ground(double x, double z, double size_x, double size_z, double scale_y) const {
  const double mid_x = x + 0.5 * size_x, mid_z = z + 0.5 * size_z;
  const double west = height(x, mid_z), east = height(x + size_x, mid_z);
  const double south = height(mid_x, z), north = height(mid_x, z + size_z);
  const double slope_x = (east - west) / size_x, slope_z = (north - south) / size_z;
  const double middle = 0.25 * (west + east + south + north);
  return DAffine(DVec3(1, slope_x, 0), DVec3(0, scale_y, 0), DVec3(0, slope_z, 1),
                 DVec3(x, middle - 0.5 * (slope_x * size_x + slope_z * size_z), z));
}

Model MeadowTerrain::make_ground() const {
  std::vector<double> xs = grid_lines(-kReach, -63.0, 63.0, kReach);
  xs.insert(xs.end(), std::begin(kLaneLines), std::end(kLaneLines));
  std::sort(xs.begin(), xs.end());
  const std::vector<double> zs = grid_lines(-30.0, -15.0, 90.0, kReach);
  std::vector<DVec3> points;
  for (const double z : zs) {
    for (const double x : xs) {
      const bool rut = x > 0.0 && x < kCell && lane_material(x) == "lane_rut";
      points.push_back(place(x, z) - DVec3(0, rut ? 0.07 : 0.0, 0));
    }
  }
  Model model;
  PatchBuilder patch(model, points);
  for (size_t j = 0; j + 1 < zs.size(); ++j) {
    for (size_t i = 0; i + 1 < xs.size(); ++i) {
      const double x = 0.5 * (xs[i] + xs[i + 1]), z = 0.5 * (zs[j] + zs[j + 1]);
      const size_t low = j * xs.size() + i, high = low + xs.size();
      const bool lane = x > 0.0 && x < kCell;
      const double tone = fractal_noise({x * 0.05, 3.0, z * 0.05}, seed_ + 21, 2);
      const std::string_view turf = std::sqrt(x * x + z * z) < 60.0 ? "turf_near" : tone > 0.05 ? "turf_b" : "turf_a";
      patch.quad(lane ? lane_material(x) : turf, {low, high, high + 1, low + 1});
    }
  }
  return model;
}

} // namespace packtrace::scenegen
