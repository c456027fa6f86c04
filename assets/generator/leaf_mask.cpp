#include "assets/generator/leaf_mask.h"

#include <cmath>
#include <vector>

#include "assets/generator/placement.h"
#include "assets/generator/png_output.h"

namespace packtrace::scenegen {
namespace {

constexpr uint32_t kWidth = 96, kHeight = 128;

/// Whether a point is inside the leaf; x across in [-1,1], y from 0 at the stalk to 1 at the tip.
bool inside(double x, double y) {
  if (y < 0.12) return std::abs(x) < 0.035; // stalk
  const double t = (y - 0.12) / 0.86;
  if (t > 1.0) return false;
  const double lobes =
      0.93 + 0.07 * sin_cos(2.0 * kPi * (5.0 * t - 0.55 * std::abs(x))).cos; // notches slant towards the tip
  const double edge = 1.75 * std::sqrt(t) * (1.0 - t) * (1.25 - 0.25 * t) * lobes + 0.03 * (1.0 - t);
  if (std::abs(x) > edge) return false;
  const double rib = std::abs(x) / (edge + 1e-9);
  const double hole = sin_cos(2.0 * kPi * (5.0 * t + 0.5 - 0.55 * std::abs(x))).cos;
  return !(rib > 0.25 && rib < 0.48 && hole > 0.86 && t < 0.85);
}

} // namespace

void generate_leaf_mask(const OutputConfig& output) {
  std::vector<uint8_t> texels;
  for (uint32_t row = 0; row < kHeight; ++row) {
    for (uint32_t column = 0; column < kWidth; ++column) {
      const double x = (column + 0.5) / kWidth * 2.0 - 1.0, y = 1.0 - (row + 0.5) / kHeight;
      texels.push_back(inside(x, y) ? 255 : 0);
    }
  }
  BufferedFile file(output.folder / "leaf.png", output.overwrite);
  write_png(file, kWidth, kHeight, 1, texels);
  file.close();
}

} // namespace packtrace::scenegen
