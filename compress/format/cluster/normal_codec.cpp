#include "compress/format/cluster/normal_codec.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace packtrace {
namespace {

using Double2 = double __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

int32_t last_x(const NormalFormat& format) { return static_cast<int32_t>(format.x_codes) - 1; }
int32_t last_y(const NormalFormat& format) { return static_cast<int32_t>(format.y_codes) - 1; }

Vec3 decode_zsign(NormalFields fields) {
  const float x = static_cast<float>(fields.x) * (2.0f / static_cast<float>(kZsignXLast)) - 1.0f;
  const float y = static_cast<float>(fields.y) * (2.0f / static_cast<float>(kZsignYLast)) - 1.0f;
  const float planar = x * x + y * y;
  if (planar >= 1.0f) {
    const float scale = 1.0f / std::sqrt(planar);
    return {x * scale, y * scale, 0.0f};
  }
  const float z = std::sqrt(1.0f - planar);
  return {x, y, fields.chart != 0 ? -z : z};
}

/// @param t twice the code's distance from the middle code, divided by the number of steps: -1 .. 1; one or a vector
template <class T>
T warp(T t) {
  return t * (static_cast<float>(kAxisSlope) + static_cast<float>(kAxisCubic) * (t * t));
}

/// Works on each lane.
Double2 inverse_warp(Double2 x) {
  Double2 t = x * 1.4142135623730951;
  for (int i = 0; i < 3; ++i) // Newton's method: the first guess is within 0.04, and each step about squares the error
    t -= (t * (kAxisSlope + kAxisCubic * t * t) - x) / (kAxisSlope + 3.0 * kAxisCubic * t * t);
  return t;
}

/// Component of a coordinate of an axis encoding.
float axis_component(int32_t coordinate, int32_t last) {
  return warp(static_cast<float>(2 * coordinate - last) * (1.0f / static_cast<float>(last)));
}

/// @param u, v components along the two axes after the chart's
Vec3 axis_normal(uint32_t chart, float u, float v) {
  // u^2 + v^2 is summed first, so that w keeps its bits if u and v swap places, as they do between charts.
  const float w = std::sqrt(std::max(1.0f - (u * u + v * v), 0.0f));
  const float signed_w = (chart & 1u) != 0 ? -w : w;
  const uint32_t axis = chart / 2;
  return axis == 0 ? Vec3(signed_w, u, v) : axis == 1 ? Vec3(v, signed_w, u) : Vec3(u, v, signed_w);
}

Vec3 decode_axis(const NormalFormat& format, NormalFields fields) {
  const int32_t last = last_x(format);
  return axis_normal(fields.chart, axis_component(fields.x, last), axis_component(fields.y, last));
}

Vec3 decode_oct(const NormalFormat& format, NormalFields fields) {
  const int32_t middle = last_x(format) / 2;
  const float scale = 1.0f / static_cast<float>(middle);
  float x = static_cast<float>(fields.x - middle) * scale;
  float y = static_cast<float>(fields.y - middle) * scale;
  const float z = 1.0f - std::abs(x) - std::abs(y);
  const float fold = std::max(-z, 0.0f);
  x -= std::copysign(fold, x);
  y -= std::copysign(fold, y);
  const float length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

/// Finds the code nearest to n among candidates x0 .. x1 by y0 .. y1 of one chart.
class Nearest {
public:
  Nearest(NormalEncoding encoding, DVec3 n) : encoding_(encoding), n_(n) {}

  void search(uint32_t chart, int32_t x0, int32_t x1, int32_t y0, int32_t y1) {
    for (int32_t x = x0; x <= x1; ++x)
      for (int32_t y = y0; y <= y1; ++y) try_code({chart, x, y}, decode_normal(encoding_, NormalFields{chart, x, y}));
  }

  void try_code(NormalFields fields, Vec3 decoded) {
    // Chords are compared instead of dot products, because cosines of such small angles round to 1.
    const DVec3 d = DVec3(decoded) - n_;
    const double distance = glm::dot(d, d);
    if (distance < distance_) distance_ = distance, best_ = fields, decoded_ = decoded;
  }

  NearestNormal result() const { return {join_normal_code(encoding_, best_), decoded_}; }

private:
  NormalEncoding encoding_;
  DVec3 n_;
  NormalFields best_;
  Vec3 decoded_{};
  double distance_ = 5.0; // squared chords of the unit sphere are at most 4
};

int32_t rounded(double x) { return static_cast<int32_t>(std::lrint(x)); }

void search_zsign(Nearest& nearest, DVec3 n) {
  const int32_t x = rounded((n.x + 1.0) * 0.5 * kZsignXLast), y = rounded((n.y + 1.0) * 0.5 * kZsignYLast);
  nearest.search(std::signbit(n.z) ? 1 : 0, std::max(x - 1, 0), std::min(x + 1, kZsignXLast), std::max(y - 1, 0),
                 std::min(y + 1, kZsignYLast));
}

/// Returns the lower of the two codes around t, where last + 1 codes span -1 .. 1.
int32_t code_below(double t, int32_t last) {
  return std::clamp(static_cast<int32_t>((t + 1.0) * 0.5 * last), 0, last - 1);
}

void search_axis(Nearest& nearest, int32_t last, DVec3 n) {
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (std::abs(n[other]) > std::abs(n[axis])) axis = other;
  const int u_axis = (axis + 1) % 3, v_axis = (axis + 2) % 3;
  const Double2 t = inverse_warp(Double2{n[u_axis], n[v_axis]});
  const int32_t x = code_below(t[0], last), y = code_below(t[1], last);
  const auto chart = static_cast<uint32_t>(2 * axis) + (n[axis] < 0.0 ? 1u : 0u);
  // Lanes: the codes (x, y), (x, y + 1), (x + 1, y) and (x + 1, y + 1), decoded as by axis_normal().
  const Float4 parts =
      warp(__builtin_convertvector(2 * Int4{x, x + 1, y, y + 1} - last, Float4) * (1.0f / static_cast<float>(last)));
  const Float4 u = __builtin_shufflevector(parts, parts, 0, 0, 1, 1),
               v = __builtin_shufflevector(parts, parts, 2, 3, 2, 3);
  const Float4 square = 1.0f - (u * u + v * v);
  Float4 w;
  for (int i = 0; i < 4; ++i) w[i] = std::sqrt(std::max(square[i], 0.0f));
  if (n[axis] < 0.0) w = -w;
  std::array<Double4, 3> squares; // along each axis; their sums are squared chords, as in Nearest
  const auto put_square = [&](int along, Float4 component) {
    const Double4 d = __builtin_convertvector(component, Double4) - n[along];
    squares[static_cast<size_t>(along)] = d * d;
  };
  put_square(axis, w), put_square(u_axis, u), put_square(v_axis, v);
  const Double4 distances = squares[0] + squares[1] + squares[2];
  int best = 0;
  for (int i = 1; i < 4; ++i)
    if (distances[i] < distances[best]) best = i;
  Vec3 decoded;
  decoded[axis] = w[best], decoded[u_axis] = u[best], decoded[v_axis] = v[best];
  nearest.try_code({chart, x + best / 2, y + best % 2}, decoded);
}

void search_oct(Nearest& nearest, int32_t last, DVec3 n) {
  n /= std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  const int32_t x = code_below(n.z < 0.0 ? std::copysign(1.0 - std::abs(n.y), n.x) : n.x, last);
  const int32_t y = code_below(n.z < 0.0 ? std::copysign(1.0 - std::abs(n.x), n.y) : n.y, last);
  nearest.search(0, x, x + 1, y, y + 1);
}

} // namespace

std::optional<NormalEncoding> find_normal_encoding(std::string_view name) {
  for (size_t i = 0; i < kNormalFormats.size(); ++i)
    if (kNormalFormats[i].name == name) return static_cast<NormalEncoding>(i);
  return std::nullopt;
}

NormalFields split_normal_code(NormalEncoding encoding, uint32_t code) {
  const NormalFormat& format = format_of(encoding);
  const uint32_t column = code / format.y_codes;
  return {std::min(column / format.x_codes, format.charts - 1), static_cast<int32_t>(column % format.x_codes),
          static_cast<int32_t>(code % format.y_codes)};
}

uint32_t join_normal_code(NormalEncoding encoding, NormalFields fields) {
  const NormalFormat& format = format_of(encoding);
  return (fields.chart * format.x_codes + static_cast<uint32_t>(fields.x)) * format.y_codes +
         static_cast<uint32_t>(fields.y);
}

// Layout of the cross around face a with sign s: x runs along axis a + 1 and y along axis a + 2. Beyond the border of
// the face the coordinate continues on the neighbour, one code later. There it counts the decrease of the neighbour's
// coordinate along a.

std::optional<NormalFields> unfold_normal(NormalEncoding encoding, NormalFields fields, uint32_t chart) {
  if (fields.chart == chart) return fields;
  const NormalFormat& format = format_of(encoding);
  if (format.family != NormalFamily::kAxis || fields.chart / 2 == chart / 2) return std::nullopt;
  const int32_t last = last_x(format);
  const bool along_x = fields.chart / 2 == (chart / 2 + 1) % 3;
  const int32_t height = along_x ? fields.y : fields.x; // coordinate along the chart's axis
  const int32_t sunk = (chart & 1u) != 0 ? height : last - height;
  const int32_t beyond = (fields.chart & 1u) != 0 ? -1 - sunk : last + 1 + sunk;
  return along_x ? NormalFields{chart, beyond, fields.x} : NormalFields{chart, fields.y, beyond};
}

NormalFields fold_normal(NormalEncoding encoding, NormalFields fields) {
  const NormalFormat& format = format_of(encoding);
  const uint32_t chart = std::min(fields.chart, format.charts - 1);
  const int32_t last = last_x(format);
  // Distance past the border, above 0 outside the face.
  const auto beyond = [&](int32_t c) { return std::max(c - last, -c); };
  const int32_t x = std::clamp(fields.x, 0, last), y = std::clamp(fields.y, 0, last_y(format));
  if (format.family != NormalFamily::kAxis || std::max(beyond(fields.x), beyond(fields.y)) <= 0) return {chart, x, y};
  const bool along_x = beyond(fields.x) > 0;
  const int32_t sunk = std::min(beyond(along_x ? fields.x : fields.y) - 1, last);
  const int32_t height = (chart & 1u) != 0 ? sunk : last - sunk;
  const uint32_t sign = (along_x ? fields.x : fields.y) < 0 ? 1 : 0;
  const uint32_t neighbour = 2 * ((chart / 2 + (along_x ? 1 : 2)) % 3) + sign;
  return along_x ? NormalFields{neighbour, y, height} : NormalFields{neighbour, height, x};
}

Vec3 decode_normal(NormalEncoding encoding, NormalFields fields) {
  const NormalFormat& format = format_of(encoding);
  switch (format.family) {
  case NormalFamily::kZsign:
    return decode_zsign(fields);
  case NormalFamily::kAxis:
    return decode_axis(format, fields);
  case NormalFamily::kOct:
    return decode_oct(format, fields);
  }
  assert(false);
  return {};
}

Vec3 decode_normal(NormalEncoding encoding, uint32_t code) {
  return decode_normal(encoding, split_normal_code(encoding, code));
}

uint32_t encode_normal(NormalEncoding encoding, DVec3 n) { return find_nearest_normal(encoding, n).code; }

NearestNormal find_nearest_normal(NormalEncoding encoding, DVec3 n) {
  // Scaling by the largest component first keeps the squares from overflow and underflow.
  n /= std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  n /= glm::length(n);
  const NormalFormat& format = format_of(encoding);
  Nearest nearest(encoding, n);
  switch (format.family) {
  case NormalFamily::kZsign:
    search_zsign(nearest, n);
    break;
  case NormalFamily::kAxis:
    search_axis(nearest, last_x(format), n);
    break;
  case NormalFamily::kOct:
    search_oct(nearest, last_x(format) - 1, n); // an even number of codes leaves one code unused
    break;
  }
  return nearest.result();
}

} // namespace packtrace
