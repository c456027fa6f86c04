#include "runtime/denoise/pair_guides.h"

#include <tbb/enumerable_thread_specific.h>

#include "runtime/denoise/depth_derivatives.h"

namespace packtrace {
namespace {

constexpr int kKept = 8; ///< rows of derivatives; more than the largest step

/// Derivatives of the last rows.
class DerivedRows {
public:
  explicit DerivedRows(uint32_t width)
      : stride_(static_cast<size_t>(width) + 2 * kRowPadding), data_(2 * kKept * stride_) {}
  float* dx(int y) { return data_.data() + static_cast<size_t>(y & (kKept - 1)) * 2 * stride_ + kRowPadding; }
  float* dy(int y) { return dx(y) + stride_; }

private:
  size_t stride_;
  std::vector<float> data_;
};

} // namespace

void PairGuides::resize(ImageSize size) {
  for (Step& step : steps_)
    for (Plane<uint8_t>& plane : step) plane.resize(size);
}

void PairGuides::compute(const Guides& guides, const FluxConfig& config, const FilterKernels& kernels) {
  const int width = static_cast<int>(guides.size.width), height = static_cast<int>(guides.size.height);
  tbb::enumerable_thread_specific<DerivedRows> derived(guides.size.width);
  for_row_blocks(guides.size.height, [&](int first, int last) {
    DerivedRows& rows = derived.local();
    const auto surface = [&](int y) {
      return SurfaceRow{guides.disparity.row(y), rows.dx(y), rows.dy(y), guides.normal_x.row(y), guides.normal_y.row(y),
                        guides.normal_z.row(y)};
    };
    int next = first;
    for (int y = first; y < last; ++y) {
      for (; next <= std::min(y + kSteps.back(), height - 1); ++next)
        derive_row(width, guides.disparity.row(next - 1), guides.disparity.row(next), guides.disparity.row(next + 1),
                   rows.dx(next), rows.dy(next));
      for (size_t i = 0; i < kSteps.size(); ++i) {
        Step& s = steps_[i];
        kernels.guide(width, kSteps[i], surface(y), surface(y + kSteps[i]), {config.guide_depth, config.guide_slope},
                      {s[0].row(y), s[1].row(y), s[2].row(y), s[3].row(y)});
      }
    }
  });
}

} // namespace packtrace
