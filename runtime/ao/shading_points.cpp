#include "runtime/ao/shading_points.h"

#include "runtime/ao/hemisphere.h"
#include "runtime/simd.h"

namespace packtrace {
namespace {

struct VectorArrays {
  float *x, *y, *z;
  Vec3 at(size_t i) const { return {x[i], y[i], z[i]}; }
  void set(size_t i, Vec3 v) const { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

/// Moves positions by their offsets along the normals, and into a tracer's space.
PACKTRACE_AVX2_CLONES
void lift_origins(size_t count, VectorArrays position, VectorArrays normal, const float* offset, DVec3 centre,
                  double scale) {
  const auto lifted = [scale](float p, float n, float o, double c) {
    return static_cast<float>((double{p} + double{n} * double{o} - c) * scale);
  };
#pragma GCC ivdep
  for (size_t i = 0; i < count; ++i) {
    position.x[i] = lifted(position.x[i], normal.x[i], offset[i], centre.x);
    position.y[i] = lifted(position.y[i], normal.y[i], offset[i], centre.y);
    position.z[i] = lifted(position.z[i], normal.z[i], offset[i], centre.z);
  }
}

constexpr size_t kAhead = 64; ///< pixels, of 8 x 8 in Morton order

/// Requests what load() reads of a pixel.
void prefetch(const GBuffer& g, uint32_t pixel) {
  __builtin_prefetch(&g.position[pixel]);
  __builtin_prefetch(&g.geometric_normal[pixel]);
  __builtin_prefetch(&g.normal[pixel]);
  __builtin_prefetch(&g.offset[pixel]);
}

PACKTRACE_AVX2_CLONES
void write_directions(size_t count, const float* u, const float* v, VectorArrays shading, VectorArrays geometric,
                      VectorArrays out) {
#pragma GCC ivdep
  for (size_t i = 0; i < count; ++i) {
    const Vec3 direction = turned_to(shading.at(i), cosine_direction({u[i], v[i]})), up = geometric.at(i);
    const float below = smaller(direction.x * up.x + direction.y * up.y + direction.z * up.z, 0.0f);
    out.set(i, direction - 2.0f * below * up);
  }
}

} // namespace

void ShadingPoints::load_surfaces(const GBuffer& g, const UnitSpace& space, float offset_scale) {
  const size_t n = pixel_.size();
  for (Vectors* vectors : {&origin_, &geometric_, &normal_, &direction_}) vectors->resize(n);
  offset_.resize(n), u_.resize(n), v_.resize(n), sampled_.resize(n);
  for (size_t i = 0; i < n; ++i) {
    if (i + kAhead < n) prefetch(g, pixel_[i + kAhead]);
    const uint32_t p = pixel_[i];
    const Vec3 position = g.position[p], geometric = g.geometric_normal[p], normal = g.normal[p];
    origin_.x[i] = position.x, origin_.y[i] = position.y, origin_.z[i] = position.z;
    geometric_.x[i] = geometric.x, geometric_.y[i] = geometric.y, geometric_.z[i] = geometric.z;
    normal_.x[i] = normal.x, normal_.y[i] = normal.y, normal_.z[i] = normal.z;
    offset_[i] = g.offset[p] * offset_scale;
  }
  lift_origins(n, {origin_.x.data(), origin_.y.data(), origin_.z.data()},
               {geometric_.x.data(), geometric_.y.data(), geometric_.z.data()}, offset_.data(), space.centre(),
               space.scale());
}

void ShadingPoints::copy_to(size_t first, std::span<OcclusionPoint> out) const {
  const auto at = [](const Vectors& v, size_t i) { return Vec3(v.x[i], v.y[i], v.z[i]); };
  for (size_t i = first; i < first + out.size(); ++i)
    out[i - first] = {at(origin_, i), at(geometric_, i), at(normal_, i), pixel_[i], x_px_[i], y_px_[i]};
}

void ShadingPoints::write_rays(const PixelSampler& sampler, std::span<const uint32_t> samples, float tfar,
                               std::span<Ray> rays) {
  const size_t n = rays.size();
  sampler.points(sampled_, samples.data(), n, u_.data(), v_.data());
  write_directions(n, u_.data(), v_.data(), {normal_.x.data(), normal_.y.data(), normal_.z.data()},
                   {geometric_.x.data(), geometric_.y.data(), geometric_.z.data()},
                   {direction_.x.data(), direction_.y.data(), direction_.z.data()});
  for (size_t i = 0; i < n; ++i)
    rays[i] = {
        {origin_.x[i], origin_.y[i], origin_.z[i]}, 0.0f, {direction_.x[i], direction_.y[i], direction_.z[i]}, tfar};
}

} // namespace packtrace
