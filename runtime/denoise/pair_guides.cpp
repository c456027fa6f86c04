#include "runtime/denoise/pair_guides.h"

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/depth_derivatives.h"
#include "runtime/denoise/simd.h"

namespace packtrace {
namespace {

/// Rows that a thread keeps, padded with zeros.
template <typename T>
class KeptRows {
public:
  explicit KeptRows(uint32_t width)
      : stride_(static_cast<size_t>(width) + 2 * kRowPadding), data_((kKept + 1) * stride_) {}
  T* row(int y) { return data_.data() + static_cast<size_t>(y & (kKept - 1)) * stride_ + kRowPadding; }
  const T* zeros() const { return data_.data() + kKept * stride_ + kRowPadding; }

private:
  static constexpr size_t kKept = 8; ///< more than the largest step and the rows above and below
  size_t stride_;
  std::vector<T> data_;
};

/// Computes the last two of SurfaceRow::rise from the first two.
PACKTRACE_AVX2_CLONES
void derive_diagonals(int width, const std::array<float*, 4>& rise) {
  const float *right = rise[0], *down = rise[1];
  float *down_right = rise[2], *down_left = rise[3];
#pragma GCC ivdep
  for (int x = 0; x < width; ++x) down_right[x] = right[x] + down[x], down_left[x] = down[x] - right[x];
}

/// Computes SurfaceRow::normal_xy and normal_z.
PACKTRACE_AVX2_CLONES
void pair_normals(int width, const int16_t* nx, const int16_t* ny, const int16_t* nz, uint32_t* __restrict xy,
                  uint32_t* __restrict z) {
  for (int x = 0; x < width; ++x) {
    xy[x] = static_cast<uint32_t>(static_cast<uint16_t>(nx[x])) | static_cast<uint32_t>(ny[x]) << 16;
    z[x] = static_cast<uint16_t>(nz[x]);
  }
}

/// Guide weights of consecutive rows, as one thread computes them.
class GuideRows {
public:
  GuideRows(const Guides& guides, const GuideTerms& terms, const FilterKernels& kernels)
      : guides_(guides), terms_(terms), kernels_(kernels), width_(static_cast<int>(guides.size.width)),
        height_(static_cast<int>(guides.size.height)), rise_(four<float>(guides.size.width)),
        normal_xy_(guides.size.width), normal_z_(guides.size.width), lone_(guides.size.width),
        near_(four<uint8_t>(guides.size.width)), far_(four<uint8_t>(guides.size.width)) {}

  /// Starts anew at row y.
  void begin(int y) { next_derived_ = next_near_ = std::max(y - 1, 0), next_lone_ = y; }

  /// Computes the weights of a row; rows come in ascending order.
  void write(int y, size_t step_index, const std::array<uint8_t*, 4>& weights) {
    const int step = PairGuides::kSteps[step_index];
    for (; next_lone_ <= std::min(y + PairGuides::kSteps.back(), height_ - 1); ++next_lone_) find_lone(next_lone_);
    auto& unraised = step == 1 ? near_ : far_;
    if (step != 1) kernels_.guide(width_, step, surface(y), surface(y + step), terms_, rows_of(unraised, y));
    kernels_.raise_guides(width_, step, pairs(unraised, y), lone_.row(y),
                          y + step < height_ ? lone_.row(y + step) : lone_.zeros(), weights);
  }

private:
  template <typename T>
  using Four = std::array<KeptRows<T>, 4>;
  template <typename T>
  static Four<T> four(uint32_t width) {
    return {KeptRows<T>(width), KeptRows<T>(width), KeptRows<T>(width), KeptRows<T>(width)};
  }
  template <typename T>
  static std::array<T*, 4> rows_of(Four<T>& rings, int y) {
    return {rings[0].row(y), rings[1].row(y), rings[2].row(y), rings[3].row(y)};
  }

  SurfaceRow surface(int y) {
    return {guides_.disparity.row(y),
            {rise_[0].row(y), rise_[1].row(y), rise_[2].row(y), rise_[3].row(y)},
            normal_xy_.row(y),
            normal_z_.row(y)};
  }

  static PairRow pairs(Four<uint8_t>& rings, int y) {
    PairRow rows;
    for (size_t d = 0; d < rows.size(); ++d) rows[d] = y >= 0 ? rings[d].row(y) : rings[d].zeros();
    return rows;
  }

  void derive(int y) {
    const Plane<float>& disparity = guides_.disparity;
    derive_row(width_, disparity.row(y - 1), disparity.row(y), disparity.row(y + 1), rise_[0].row(y), rise_[1].row(y));
    derive_diagonals(width_, rows_of(rise_, y));
    pair_normals(width_, guides_.normal_x.row(y), guides_.normal_y.row(y), guides_.normal_z.row(y), normal_xy_.row(y),
                 normal_z_.row(y));
  }

  void find_lone(int y) {
    for (; next_near_ <= y; ++next_near_) {
      for (; next_derived_ <= std::min(next_near_ + 1, height_ - 1); ++next_derived_) derive(next_derived_);
      kernels_.guide(width_, 1, surface(next_near_), surface(next_near_ + 1), terms_, rows_of(near_, next_near_));
    }
    kernels_.lone_guide(width_, pairs(near_, y), pairs(near_, y - 1), guides_.disparity.row(y), lone_.row(y));
  }

  const Guides& guides_;
  const GuideTerms terms_;
  const FilterKernels& kernels_;
  int width_, height_;
  int next_derived_ = 0, next_near_ = 0, next_lone_ = 0;
  Four<float> rise_; ///< of the disparity
  KeptRows<uint32_t> normal_xy_, normal_z_;
  KeptRows<uint8_t> lone_;
  Four<uint8_t> near_, far_; ///< weights of the pairs one pixel apart, and of those farther apart, not raised
};

} // namespace

void PairGuides::compute(const Guides& guides, const FluxConfig& config, const FilterKernels& kernels,
                         const Memory& memory) {
  begin_ = {reinterpret_cast<uint8_t*>(memory.first.row(0)), reinterpret_cast<uint8_t*>(memory.second.row(0)),
            reinterpret_cast<uint8_t*>(memory.third.row(0))};
  static_assert(sizeof(*memory.first.row(0)) == kPairOffsets.size());
  stride_ = memory.first.stride() * static_cast<ptrdiff_t>(kPairOffsets.size());
  width_ = static_cast<ptrdiff_t>(guides.size.width);
  // With arguments instead of a function it would keep copies of them, and so of all guides.
  tbb::enumerable_thread_specific<GuideRows> threads(
      [&] { return GuideRows(guides, {config.guide_depth, config.guide_slope, config.guide_bend}, kernels); });
  for_row_blocks(guides.size.height, [&](int first, int last) {
    GuideRows& rows = threads.local();
    rows.begin(first);
    for (int y = first; y < last; ++y)
      for (size_t i = 0; i < kSteps.size(); ++i) {
        uint8_t* const weights = begin_[i] + y * stride_;
        rows.write(y, i, {weights, weights + width_, weights + 2 * width_, weights + 3 * width_});
      }
  });
}

} // namespace packtrace
