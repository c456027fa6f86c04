#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/camera/gbuffer.h"
#include "runtime/simd.h"

namespace packtrace {

// How alike the surfaces of two pixels are, for pictures at half resolution. Floats suffice at any scale, because lines
// are divided by their largest component.

inline constexpr float kMaxSlope = 0.3f;    ///< sine of the angle between line and surface from which the weight is 0
inline constexpr float kNormalSlack = 1.1f; ///< normals up to acos(1 / 1.1) = 25 degrees apart count as equal
inline constexpr int kNormalSquarings = 6;  ///< cosine to the power of 64

/// What a pixel shows: a point in the world, the geometric and the shading normal.
struct PixelSurface {
  Vec3 position, geometric, shading;
};

/// How two surface points relate.
struct Relation {
  float cosine; ///< between the shading normals
  float slope2; ///< squared sine of the angle between their line and the surfaces, the larger one
};

[[gnu::always_inline]] inline Relation relate(const PixelSurface& a, const PixelSurface& b) {
  const Vec3 line = b.position - a.position;
  const float extent = larger(larger(std::abs(line.x), std::abs(line.y)), std::abs(line.z));
  const float scale = extent > 0.0f ? extent : 1.0f;
  const Vec3 along(line.x / scale, line.y / scale, line.z / scale);
  const float length2 = glm::dot(along, along);
  const float height = larger(std::abs(glm::dot(a.geometric, along)), std::abs(glm::dot(b.geometric, along)));
  return {glm::dot(a.shading, b.shading), extent > 0.0f ? height * height / length2 : 0.0f};
}

/// 1 for points of one plane, 0 for points of different surfaces.
[[gnu::always_inline]] inline float similarity(Relation r) {
  float aligned = smaller(1.0f, kNormalSlack * r.cosine);
  const float flat = 1.0f - r.slope2 / (kMaxSlope * kMaxSlope);
  const float least = smaller(flat, aligned); // not a bool, which would keep GCC from vectorising; NaN if flat is
  for (int i = 0; i < kNormalSquarings; ++i) aligned *= aligned;
  return least > 0.0f ? aligned * flat * flat : 0.0f;
}

/// Surface points as columns of their nine numbers, which vectors of floats read.
class PointColumns {
public:
  void resize(size_t count) {
    for (std::vector<float>& column : numbers_) column.resize(count);
  }
  void set(size_t i, const PixelSurface& p) {
    for (glm::length_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<size_t>(axis);
      numbers_[a][i] = p.position[axis], numbers_[3 + a][i] = p.geometric[axis], numbers_[6 + a][i] = p.shading[axis];
    }
  }

  /// Pointers that stores to other arrays cannot change.
  struct Reader {
    std::array<const float*, 9> n;
    [[gnu::always_inline]] PixelSurface at(size_t i) const {
      return {{n[0][i], n[1][i], n[2][i]}, {n[3][i], n[4][i], n[5][i]}, {n[6][i], n[7][i], n[8][i]}};
    }
  };
  Reader reader() const {
    Reader reader;
    for (size_t i = 0; i < numbers_.size(); ++i) reader.n[i] = numbers_[i].data();
    return reader;
  }

private:
  std::array<std::vector<float>, 9> numbers_;
};

inline PixelSurface pixel_surface(const GBuffer& g, size_t pixel) {
  return {g.position[pixel], g.geometric_normal[pixel], g.normal[pixel]};
}

inline bool is_hit(const GBuffer& g, size_t pixel) { return g.instance[pixel] != kNoInstance; }

/// The surfaces that one pixel of each block of 2 x 2 pixels shows, for a row of blocks. Block b has index b + 1,
/// between two that show nothing.
struct BlockSurfaces {
  PointColumns points;
  std::vector<float> shown; ///< 1 if the pixel shows a surface, else 0

  /// @param half numbers of blocks along both axes
  /// @param pixels by block: the pixel of `full`
  /// @param number of the row, counted from 1; none shows anything in rows outside the picture
  void load(const GBuffer& full, ImageSize half, std::span<const uint32_t> pixels, uint32_t number) {
    points.resize(half.width + 2), shown.assign(half.width + 2, 0.0f);
    if (number == 0 || number > half.height) return;
    for (uint32_t bx = 0; bx < half.width; ++bx) {
      const uint32_t pixel = pixels[size_t{number - 1} * half.width + bx];
      points.set(bx + 1, pixel_surface(full, pixel));
      shown[bx + 1] = is_hit(full, pixel) ? 1.0f : 0.0f;
    }
  }
};

/// Keeps the last kRows rows, each of which is needed for several consecutive ones.
template <class Row, size_t kRows>
class RowCache {
public:
  RowCache() { numbers_.fill(UINT32_MAX); }
  /// Returns the row with a number, which is not UINT32_MAX. load(row) fills it if it is not kept.
  template <class Load>
  const Row& at(uint32_t number, const Load& load) {
    const size_t slot = number % kRows;
    if (numbers_[slot] != number) load(rows_[slot]);
    numbers_[slot] = number;
    return rows_[slot];
  }

private:
  std::array<Row, kRows> rows_;
  std::array<uint32_t, kRows> numbers_; ///< UINT32_MAX: none was loaded
};

} // namespace packtrace
