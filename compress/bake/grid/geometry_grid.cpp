#include "compress/bake/grid/geometry_grid.h"

#include <algorithm>
#include <bit>

#include "pbrt_import/base/weld_table.h"

namespace packtrace {
namespace {

int64_t round_coarsely(double x, double step, uint32_t shift) {
  return to_lattice(x, step * exp2_exact(static_cast<int32_t>(shift))) * (int64_t{1} << shift);
}

} // namespace

uint64_t position_key(DVec3 p) {
  const auto bits = [](double x) { return uint64_t{std::bit_cast<uint32_t>(static_cast<float>(x) + 0.0f)}; };
  return mix_words(bits(p.x), bits(p.y), bits(p.z));
}

LatticePoint GeometryGrid::round(DVec3 p) const {
  const double step = grid.step();
  uint32_t shift = 0;
  if (!shared.empty()) {
    const SharedPosition wanted{position_key(p), 0};
    const auto found = std::lower_bound(shared.begin(), shared.end(), wanted);
    if (found != shared.end() && found->key == wanted.key) shift = found->shift;
  }
  if (shift == 0) return {to_lattice(p.x, step), to_lattice(p.y, step), to_lattice(p.z, step)};
  return {round_coarsely(p.x, step, shift), round_coarsely(p.y, step, shift), round_coarsely(p.z, step, shift)};
}

uint32_t GeometryGrid::max_shift() const {
  uint32_t largest = 0;
  for (const SharedPosition& position : shared) largest = std::max(largest, position.shift);
  return largest;
}

int64_t GeometryGrid::lowest(double lo) const {
  int64_t q = to_lattice(lo, grid.step());
  for (uint32_t shift = max_shift(); shift > 0; --shift) q = std::min(q, round_coarsely(lo, grid.step(), shift));
  return q;
}

int64_t GeometryGrid::highest(double hi) const {
  int64_t q = to_lattice(hi, grid.step());
  for (uint32_t shift = max_shift(); shift > 0; --shift) q = std::max(q, round_coarsely(hi, grid.step(), shift));
  return q;
}

} // namespace packtrace
