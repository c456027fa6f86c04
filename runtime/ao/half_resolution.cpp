#include "runtime/ao/half_resolution.h"

#include <algorithm>
#include <array>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "runtime/ao/surface_similarity.h"
#include "runtime/simd.h"

namespace packtrace {
namespace {

constexpr uint32_t kBlockRows = 8;  ///< rows of blocks per task
constexpr float kSimilar = 0.99f;   ///< similarity at which the search for a more similar block stops
constexpr float kMuchLower = 0.25f; ///< difference of similarity from which another pixel of a block is chosen

constexpr std::array<std::array<uint32_t, 2>, 4> kOffsets{{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}; ///< diagonal first

/// Full pixels of a block; those beyond the right and bottom edge are left out.
struct Block {
  std::array<uint32_t, 4> pixels;
  uint32_t count = 0;

  Block(ImageSize full, uint32_t bx, uint32_t by) {
    for (const auto& [x, y] : kOffsets)
      if (2 * bx + x < full.width && 2 * by + y < full.height) pixels[count++] = (2 * by + y) * full.width + 2 * bx + x;
  }
};

template <class Body>
void for_each_row(uint32_t rows, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, rows, kBlockRows), [&](const tbb::blocked_range<uint32_t>& range) {
    for (uint32_t y = range.begin(); y != range.end(); ++y) body(y);
  });
}

/// The first pixel that shows a surface, per block.
std::vector<uint32_t> first_hits(const GBuffer& full, ImageSize half) {
  std::vector<uint32_t> pixel(half.pixels());
  for_each_row(half.height, [&](uint32_t by) {
    for (uint32_t bx = 0; bx < half.width; ++bx) {
      const Block block(full.size, bx, by);
      const auto end = block.pixels.begin() + block.count;
      const auto found = std::find_if(block.pixels.begin(), end, [&](uint32_t p) { return is_hit(full, p); });
      pixel[size_t{by} * half.width + bx] = found == end ? block.pixels[0] : *found;
    }
  });
  return pixel;
}

/// Raises similarities of pixels to those with one pixel each. Returns how many are still below kSimilar.
/// @param shown 1 if the other pixel shows a surface, else 0
PACKTRACE_AVX2_CLONES
uint32_t raise_similarities(uint32_t count, const PointColumns::Reader& pixels, size_t first,
                            const PointColumns::Reader& others, const float* shown, size_t first_other, float* best) {
  const PointColumns::Reader pixel = pixels, other = others; // local copies, which the stores below cannot change
  uint32_t open = 0;
#pragma GCC ivdep
  for (uint32_t k = 0; k < count; ++k) {
    const size_t at = first_other + k;
    best[k] = larger(best[k], shown[at] * similarity(relate(pixel.at(first + k), other.at(at))));
    open += best[k] < kSimilar ? 1 : 0;
  }
  return open;
}

/// Chooses the pixels of rows of blocks.
class PixelChooser {
public:
  PixelChooser(const GBuffer& full, ImageSize half, const std::vector<uint32_t>& first)
      : full_(full), half_(half), first_(first) {}

  /// Writes the pixel of each block of a row that is least similar to the first hits of the neighbouring blocks.
  void choose(uint32_t by, uint32_t* chosen) {
    const std::array<const BlockSurfaces*, 3> near{&row(by), &row(by + 1), &row(by + 2)};
    best_.resize(half_.width), least_.resize(half_.width);
    const uint32_t* const first = &first_[size_t{by} * half_.width];
    std::copy_n(first, half_.width, chosen);
    compare(near, near[1]->points, 1, [&](uint32_t bx) { return is_hit(full_, first[bx]); });
    for (uint32_t bx = 0; bx < half_.width; ++bx) least_[bx] = is_hit(full_, first[bx]) ? best_[bx] - kMuchLower : 0.0f;
    pixels_.resize(half_.width), others_.resize(half_.width);
    for (const auto& [x, y] : kOffsets) {
      bool any = false;
      for (uint32_t bx = 0; bx < half_.width; ++bx) {
        const uint32_t column = 2 * bx + x, pixel = (2 * by + y) * full_.size.width + column;
        const bool inside = column < full_.size.width && 2 * by + y < full_.size.height;
        const bool competes = inside && least_[bx] > 0.0f && pixel != first[bx] && is_hit(full_, pixel);
        others_[bx] = competes ? pixel : kNoPixel;
        if (competes) pixels_.set(bx, pixel_surface(full_, pixel));
        any = any || competes;
      }
      if (!any) continue;
      compare(near, pixels_, 0, [&](uint32_t bx) { return others_[bx] != kNoPixel; });
      for (uint32_t bx = 0; bx < half_.width; ++bx)
        if (best_[bx] < least_[bx]) least_[bx] = best_[bx], chosen[bx] = others_[bx];
    }
  }

private:
  /// The first hits of a row of blocks: BlockSurfaces::load().
  const BlockSurfaces& row(uint32_t number) {
    return rows_.at(number, [&](BlockSurfaces& row) { row.load(full_, half_, first_, number); });
  }

  /// Sets best_ to the largest similarity of each block's pixel to the first hits of the neighbouring blocks, or to one
  /// that is at least kSimilar; to 1 for pixels that are not wanted.
  /// @param offset index of the first block's pixel
  template <class Wanted>
  void compare(const std::array<const BlockSurfaces*, 3>& near, const PointColumns& pixels, size_t offset,
               const Wanted& wanted) {
    const PointColumns::Reader reader = pixels.reader();
    for (uint32_t begin = 0; begin < half_.width; begin += kBlocksTogether) {
      const uint32_t count = std::min(kBlocksTogether, half_.width - begin);
      uint32_t open = 0;
      for (uint32_t bx = begin; bx < begin + count; ++bx) {
        const bool compared = wanted(bx);
        best_[bx] = compared ? 0.0f : 1.0f, open += compared ? 1 : 0;
      }
      for (size_t i = 0; i < kNeighbours.size() && open > 0; ++i) {
        const BlockSurfaces& row = *near[kNeighbours[i][1]];
        open = raise_similarities(count, reader, offset + begin, row.points.reader(), row.shown.data(),
                                  size_t{begin} + kNeighbours[i][0], &best_[begin]);
      }
    }
  }

  static constexpr uint32_t kNoPixel = UINT32_MAX, kBlocksTogether = 32;
  /// Columns and rows of the neighbouring blocks, from 0 to 2; near ones first.
  static constexpr std::array<std::array<uint32_t, 2>, 8> kNeighbours{
      {{0, 1}, {2, 1}, {1, 0}, {1, 2}, {0, 0}, {2, 0}, {0, 2}, {2, 2}}};

  const GBuffer& full_;
  const ImageSize half_;
  const std::vector<uint32_t>& first_;
  RowCache<BlockSurfaces, 3> rows_;
  PointColumns pixels_;             ///< one of each block
  std::vector<float> best_, least_; ///< per block
  std::vector<uint32_t> others_;    ///< pixels that compete with the chosen ones; kNoPixel: none does
};

/// Without the channels that a G-buffer may do without: neither occlusion nor its denoiser reads them.
GBuffer pixels_of(const GBuffer& full, ImageSize half, const std::vector<uint32_t>& pixel) {
  GBuffer g;
  g.keep_channels(0);
  g.make_room(half);
  g.previous_z.resize(full.previous_z.empty() ? 0 : half.pixels());
  g.pixel_spread = 2.0f * full.pixel_spread;
  for_each_row(half.height, [&](uint32_t by) {
    for (size_t i = size_t{by} * half.width; i < size_t{by + 1} * half.width; ++i) {
      const uint32_t p = pixel[i];
      g.view_z[i] = full.view_z[p], g.position[i] = full.position[p], g.normal[i] = full.normal[p];
      g.geometric_normal[i] = full.geometric_normal[p], g.instance[i] = full.instance[p];
      g.offset[i] = full.offset[p], g.motion_px[i] = full.motion_px[p] * 0.5f;
      if (!g.previous_z.empty()) g.previous_z[i] = full.previous_z[p];
    }
  });
  return g;
}

} // namespace

HalfGBuffer halve(const GBuffer& full) {
  const ImageSize size{(full.size.width + 1) / 2, (full.size.height + 1) / 2};
  const std::vector<uint32_t> first = first_hits(full, size);
  HalfGBuffer half;
  half.pixel.resize(size.pixels());
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, size.height, kBlockRows),
                    [&](const tbb::blocked_range<uint32_t>& range) {
                      PixelChooser chooser(full, size, first);
                      for (uint32_t by = range.begin(); by != range.end(); ++by)
                        chooser.choose(by, &half.pixel[size_t{by} * size.width]);
                    });
  half.gbuffer = pixels_of(full, size, half.pixel);
  return half;
}

} // namespace packtrace
