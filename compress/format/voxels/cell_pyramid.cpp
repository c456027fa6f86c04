#include "compress/format/voxels/cell_pyramid.h"

namespace packtrace {
namespace {

/// Cells of two finer ones along an axis.
/// @param full whether all finer cells must be set that lie in the grid, or any
VoxelSet coarser(const VoxelSet& fine, bool full) {
  const VoxelIndex size = fine.size();
  VoxelSet coarse({(size[0] + 1) / 2, (size[1] + 1) / 2, (size[2] + 1) / 2});
  const auto even_bits = [](uint64_t word) { // the 32 even bits, without gaps
    word &= 0x5555555555555555u;
    word = (word | word >> 1) & 0x3333333333333333u;
    word = (word | word >> 2) & 0x0f0f0f0f0f0f0f0fu;
    word = (word | word >> 4) & 0x00ff00ff00ff00ffu;
    word = (word | word >> 8) & 0x0000ffff0000ffffu;
    return (word | word >> 16) & 0xffffffffu;
  };
  const uint32_t tail = size[0] % 64;
  const uint64_t outside = full && tail != 0 ? ~((uint64_t{1} << tail) - 1) : 0; // of the last word of a row
  for (uint32_t z = 0; z < coarse.size()[2]; ++z)
    for (uint32_t y = 0; y < coarse.size()[1]; ++y)
      for (uint32_t w = 0; w < fine.row_words(); ++w) {
        uint64_t word = full ? ~uint64_t{0} : 0;
        for (uint32_t o = 0; o < 4; ++o) {
          const uint32_t fy = 2 * y + (o & 1), fz = 2 * z + (o >> 1);
          if (fy >= size[1] || fz >= size[2]) continue;
          const uint64_t other = fine.row(fy, fz)[w] | (w + 1 == fine.row_words() ? outside : 0);
          word = full ? word & other : word | other;
        }
        uint64_t halves = even_bits(full ? word & word >> 1 : word | word >> 1);
        if (w + 1 == fine.row_words() && tail != 0) halves &= (uint64_t{1} << ((tail + 1) / 2)) - 1;
        coarse.row(y, z)[w / 2] |= halves << (32 * (w % 2));
      }
  return coarse;
}

} // namespace

CellPyramid::CellPyramid(const VoxelSet& set, uint32_t levels, const VoxelSet* full_voxels)
    : set_(set), full_voxels_(full_voxels != nullptr ? *full_voxels : set) {
  any_counts_.push_back(set.count());
  mixed_counts_.push_back(0); // a voxel is set or not
  for (uint32_t k = 1; k < levels; ++k) {
    any_.push_back(coarser(any(k - 1), false));
    full_.push_back(coarser(full(k - 1), true));
    any_counts_.push_back(any_.back().count());
    mixed_counts_.push_back(any_counts_.back() - full_.back().count());
  }
}

} // namespace packtrace
