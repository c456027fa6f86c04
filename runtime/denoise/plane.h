#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// Width of the zero border around every plane, in pixels. It lets filters read past the image without bounds checks.
inline constexpr int kPlaneBorder = 8;

/// One image channel in row-major order, surrounded by kPlaneBorder pixels that stay zero.
template <typename T>
class Plane {
public:
  /// Sets all pixels to zero.
  void resize(ImageSize size) {
    stride_ = static_cast<size_t>(size.width) + 2 * kPlaneBorder;
    data_.assign(stride_ * (static_cast<size_t>(size.height) + 2 * kPlaneBorder), T{});
  }
  /// Allocates the plane unless it has this size already: pixels are uninitialised, the border is zero.
  void make_room(ImageSize size) {
    const size_t stride = static_cast<size_t>(size.width) + 2 * kPlaneBorder;
    const size_t rows = static_cast<size_t>(size.height) + 2 * kPlaneBorder;
    if (stride_ == stride && data_.size() == stride * rows) return;
    stride_ = stride;
    data_ = {};
    data_.resize(stride * rows);
    const auto zero = [this](size_t begin, size_t end) {
      std::fill(data_.begin() + static_cast<ptrdiff_t>(begin), data_.begin() + static_cast<ptrdiff_t>(end), T{});
    };
    zero(0, offset(0));
    for (int y = 0; y < static_cast<int>(size.height); ++y) zero(offset(y) + size.width, offset(y + 1));
    zero(offset(static_cast<int>(size.height)), data_.size());
  }
  /// Frees the memory.
  void free() { *this = Plane(); }
  void clear() { std::fill(data_.begin(), data_.end(), T{}); }

  /// Pointer to pixel (0, y), for y in [-kPlaneBorder, height + kPlaneBorder). Columns [-kPlaneBorder, width +
  /// kPlaneBorder) are valid.
  T* row(int y) { return data_.data() + offset(y); }
  const T* row(int y) const { return data_.data() + offset(y); }

  size_t bytes() const { return data_.size() * sizeof(T); }

  /// Distance between rows in pixels; the same for all planes of one size.
  ptrdiff_t stride() const { return static_cast<ptrdiff_t>(stride_); }

private:
  size_t offset(int y) const { return static_cast<size_t>(y + kPlaneBorder) * stride_ + kPlaneBorder; }
  size_t stride_ = 0;
  PixelArray<T> data_;
};

/// Number of rows per task. It is fixed so that results do not depend on the number of threads.
inline constexpr int kRowsPerTask = 32;

/// Calls body(first_row, end_row) in parallel for half-open blocks of rows that cover [0, height).
template <typename Body>
void for_row_blocks(uint32_t height, const Body& body) {
  const int rows = static_cast<int>(height);
  const int blocks = (rows + kRowsPerTask - 1) / kRowsPerTask;
  tbb::parallel_for(
      tbb::blocked_range<int>(0, blocks, 1),
      [&](const tbb::blocked_range<int>& range) {
        for (int i = range.begin(); i != range.end(); ++i)
          body(i * kRowsPerTask, std::min(rows, (i + 1) * kRowsPerTask));
      },
      tbb::simple_partitioner());
}

} // namespace packtrace
