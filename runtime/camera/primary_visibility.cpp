#include "runtime/camera/primary_visibility.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>
#include <vector>

#include "runtime/camera/device_surfaces.h"
#include "runtime/camera/gbuffer_rows.h"
#include "runtime/camera/hit_triangles.h"
#include "runtime/camera/ray_columns.h"
#include "runtime/camera/surface_motion.h"
#include "runtime/camera/tiles.h"
#include "runtime/trace/ray_offset.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {
namespace {

constexpr uint32_t kBlock = 4;                  ///< pixels per axis of a block of coherent rays
constexpr uint32_t kBatch = kTileSize * kBlock; ///< rays per query: a row of blocks, small enough for the level-1 cache
constexpr uint32_t kTileRows = kTileSize / kBlock;
static_assert(kTileSize % kBlock == 0 && kBatch <= kMaxColumnRays);

/// The rays of a row of blocks. Columns hold them by rows of `stride` pixels, a multiple of kBlock. Pixels outside the
/// image get rays that hit nothing (tfar < tnear).
struct RayBatch {
  uint32_t stride = 0, count = 0;
  RayColumns columns;
  Ray rays[kBatch];    ///< block by block
  RayHit hits[kBatch]; ///< of the rays
  HitTriangles triangles;
  PlacementRuns surfaces; ///< by column element: placements with equal transforms of surfaces
  PlacementRuns normals;  ///< placements with equal transforms of normals

  /// Calls work(element of the columns, number of its ray) for all pixels.
  template <typename Work>
  void for_each(const Work& work) const {
    for (uint32_t row = 0; row < kBlock; ++row)
      for (uint32_t x = 0; x < stride; x += kBlock)
        for (uint32_t i = 0; i < kBlock; ++i) work(row * stride + x + i, x * kBlock + row * kBlock + i);
  }
  /// The number of the ray of an element.
  uint32_t ray_of(uint32_t element) const {
    const uint32_t x = element % stride, row = element / stride;
    return x / kBlock * (kBlock * kBlock) + row * kBlock + x % kBlock;
  }
};

/// @param spread PrimaryCamera::pixel_spread()
float pixel_width(Projection projection, float spread, float view_z) {
  return projection == Projection::kOrthographic ? spread : spread * view_z;
}

class PrimaryTracer {
public:
  PrimaryTracer(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                const PreviousFrame& previous, const TextureFilter& textures, GBuffer& out)
      : source_(source), tracer_(tracer), space_(tracer.space()), now_(now), motion_(source, tracer, now, previous),
        materials_(source.materials()), textures_(textures), out_(out) {}

  bool sees_motion() const { return motion_.any(); }

  /// Traces all rays of the picture at once; trace_tile() then uses these hits. Returns true if the tracer has filled
  /// the G-buffer, so that no tile is left.
  bool trace_view(const ViewTracer& tracer, const PreviousFrame& previous, const Progress& progress) {
    out_.on_gpu = tracer.trace_camera(now_, kCameraRays, std::move(out_.on_gpu), progress);
    if (!out_.on_gpu) {
      trace_spans(tracer, progress);
      return false;
    }
    if (make_device_surfaces(tracer, now_, previous, out_)) return true;
    pixel_hits_ = tracer.hits(*out_.on_gpu);
    return false;
  }

  /// Sets the pixel of the image that the first pixel of the G-buffer represents.
  void begin_at(uint32_t x, uint32_t y) { left_ = x, top_ = y; }

  void trace_tile(const Tile& tile) const {
    RayBatch batch;
    for (uint32_t y = tile.y0; y < tile.y1; y += kBlock) trace_row(y, tile, batch);
  }

private:
  /// Makes the rays here.
  void trace_spans(const ViewTracer& tracer, const Progress& progress) {
    const ImageSize size = out_.size;
    const size_t columns = (size.width + kTileSize - 1) / kTileSize, rows = (size.height + kTileSize - 1) / kTileSize;
    std::vector<Ray> rays(columns * rows * kTileRows * kBatch, Ray{Vec3(0), 0.0f, Vec3(0, 0, 1), -1.0f});
    Progress quiet;
    for_each_tile(size, quiet, [&](const Tile& tile) {
      RayBatch batch;
      for (uint32_t y = tile.y0; y < tile.y1; y += kBlock) {
        make_rays(y, tile, batch);
        std::copy_n(batch.rays, batch.count, &rays[place_of(y, tile)]);
      }
    });
    view_hits_.resize(rays.size());
    tracer.trace_view(rays, kCameraRays, view_hits_, progress);
  }

  void find_hits(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    if (!view_hits_.empty()) {
      std::copy_n(&view_hits_[place_of(y0, tile)], batch.count, batch.hits);
    } else if (!pixel_hits_.empty()) {
      batch.for_each([&](uint32_t i, uint32_t ray) {
        batch.hits[ray] = is_inside(i, tile, batch) ? pixel_hits_[pixel_of(i, batch)] : RayHit{};
      });
    } else {
      tracer_.closest_hits({batch.rays, batch.count}, kCameraRays, RayOrder::kCoherent, {batch.hits, batch.count});
    }
  }

  static bool is_inside(uint32_t i, const Tile& tile, const RayBatch& batch) {
    return batch.columns.x[i] < tile.x1 && batch.columns.y[i] < tile.y1;
  }

  void trace_row(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    make_rays(y0, tile, batch);
    const uint32_t rows = std::min(kBlock, tile.y1 - y0);
    for (uint32_t row = 0; row < rows; ++row) fetch_row({row * batch.stride, tile.x1 - tile.x0}, batch);
    find_hits(y0, tile, batch);
    list_triangles(batch);
    if (batch.triangles.count() > 0) place_hits(batch);
    for (uint32_t row = 0; row < rows; ++row) write_row({row * batch.stride, tile.x1 - tile.x0}, batch);
  }

  /// Place of a tile's row of blocks in the rays of the whole picture.
  size_t place_of(uint32_t y0, const Tile& tile) const {
    const size_t columns = (out_.size.width + kTileSize - 1) / kTileSize;
    const size_t number = tile.y0 / kTileSize * columns + tile.x0 / kTileSize;
    return (number * kTileRows + (y0 - tile.y0) / kBlock) * kBatch;
  }

  void make_rays(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    RayColumns& c = batch.columns;
    batch.stride = (tile.x1 - tile.x0 + kBlock - 1) / kBlock * kBlock;
    batch.count = batch.stride * kBlock;
    for (uint32_t y = 0; y < kBlock; ++y) {
      std::iota(c.x + y * batch.stride, c.x + (y + 1) * batch.stride, tile.x0);
      std::fill_n(c.y + y * batch.stride, batch.stride, y0 + y);
    }
    write_rays(now_, space_, batch.count, c);
    if (!start_near(batch.count, c)) return approach(tile, batch);
    const bool whole = tile.x1 - tile.x0 == batch.stride && tile.y1 - y0 >= kBlock;
    batch.for_each(
        [&](uint32_t i, uint32_t ray) { batch.rays[ray] = ray_at(i, whole || is_inside(i, tile, batch), c); });
  }

  void approach(const Tile& tile, RayBatch& batch) const {
    RayColumns& c = batch.columns;
    batch.for_each([&](uint32_t i, uint32_t number) {
      CameraRay ray{c.origin.at(i), c.direction.at(i)};
      const bool traced = approach_scene(ray) && is_inside(i, tile, batch);
      c.origin.set(i, ray.origin);
      batch.rays[number] = ray_at(i, traced, c);
    });
  }

  static Ray ray_at(uint32_t i, bool traced, const RayColumns& c) {
    return {Vec3(c.origin.at(i)), 0.0f, Vec3(c.direction.at(i)),
            traced ? std::numeric_limits<float>::infinity() : -1.0f};
  }

  bool keeps(GBufferChannel channel) const { return (out_.channels & channel) != 0; }

  size_t pixel_of(uint32_t i, const RayBatch& batch) const {
    return static_cast<size_t>(batch.columns.y[i] - top_) * out_.size.width + (batch.columns.x[i] - left_);
  }

  /// Finds the triangles that the rays hit.
  static void list_triangles(RayBatch& batch) {
    RayColumns& c = batch.columns;
    batch.triangles.clear();
    int32_t last = 0;
    batch.for_each([&](uint32_t i, uint32_t ray) {
      const RayHit& hit = batch.hits[ray];
      const bool valid = hit.valid();
      if (valid) last = static_cast<int32_t>(batch.triangles.number_of(hit));
      c.hit[i] = valid, c.triangle[i] = last;
      c.u[i] = hit.u, c.v[i] = hit.v;
    });
  }

  /// Computes the surface points of all hits.
  void place_hits(RayBatch& batch) const {
    RayColumns& c = batch.columns;
    batch.triangles.resolve(tracer_, source_);
    gather_vertices(batch.triangles.columns(), batch.count, c);
    batch.surfaces.sort(batch.triangles, [](const Placement& a, const Placement& b) {
      return a.instanced == b.instanced && a.unit_from_surface == b.unit_from_surface &&
             a.surface_normal == b.surface_normal && a.moved_linear == b.moved_linear &&
             a.moved_offset == b.moved_offset;
    });
    batch.surfaces.for_each(c.triangle, batch.count, [&](const Placement& placement, uint32_t first, uint32_t count) {
      meet_surfaces(placement, space_, first, count, c);
    });
    place_normals(batch);
    write_depths(now_, batch.count, c);
    if (motion_.any()) motion_.move_with_camera(batch.count, c);
  }

  void place_normals(RayBatch& batch) const {
    RayColumns& c = batch.columns;
    if (batch.triangles.has_normals())
      interpolate_normals(batch.triangles.columns(), batch.count, c);
    else
      look_up_normals(batch);
    batch.normals.sort(batch.triangles,
                       [](const Placement& a, const Placement& b) { return a.object_normal == b.object_normal; });
    batch.normals.for_each(c.triangle, batch.count, [&](const Placement& placement, uint32_t first, uint32_t count) {
      face_normals(placement.object_normal, first, count, c);
    });
  }

  void look_up_normals(RayBatch& batch) const {
    RayColumns& c = batch.columns;
    for (uint32_t i = 0; i < batch.count; ++i) {
      std::optional<Vec3> normal;
      if (c.hit[i] != 0) {
        const HitSurface& surface = batch.triangles.surface(c.triangle[i]);
        normal = source_.shading_normal(surface.geometry, surface.triangle, Vec2(c.u[i], c.v[i]));
      }
      c.has_normal[i] = normal.has_value();
      for (int axis = 0; axis < 3; ++axis) c.object_normal[axis][i] = normal ? (*normal)[axis] : 0.0f;
    }
  }

  /// Moves pixels of a row near, while the rays are traced: their memory is mostly in no cache.
  void fetch_row(ColumnRow row, const RayBatch& batch) const {
    const size_t pixel = pixel_of(row.first, batch);
    const auto fetch = [&](auto& channel) {
      constexpr size_t kLine = 64;
      if (channel.empty()) return;
      const char* const first = reinterpret_cast<const char*>(&channel[pixel]);
      for (size_t at = 0; at < row.count * sizeof(channel[0]); at += kLine) __builtin_prefetch(first + at, 1);
    };
    fetch(out_.view_z), fetch(out_.position), fetch(out_.geometric_normal), fetch(out_.normal), fetch(out_.instance);
    fetch(out_.offset), fetch(out_.motion_px), fetch(out_.previous_z), fetch(out_.albedo), fetch(out_.triangle);
    fetch(out_.material);
  }

  /// Writes pixels of a row.
  void write_row(ColumnRow row, const RayBatch& batch) const {
    const RayColumns& c = batch.columns;
    const HitTriangles& triangles = batch.triangles;
    const size_t pixel = pixel_of(row.first, batch);
    const uint32_t *instances = triangles.instances(), *materials = triangles.materials();
    write_depths(c, row, &out_.view_z[pixel]);
    write_vectors(c.position, c, row, &out_.position[pixel]);
    write_vectors(c.normal, c, row, &out_.geometric_normal[pixel]);
    write_normals(c, row, &out_.normal[pixel]);
    write_of_triangles(instances, kNoInstance, c, row, &out_.instance[pixel]);
    write_numbers(c.offset, c, row, &out_.offset[pixel]);
    if (keeps(kTriangleChannel)) write_of_triangles(triangles.triangles(), 0, c, row, &out_.triangle[pixel]);
    if (keeps(kMaterialChannel)) write_of_triangles(materials, 0, c, row, &out_.material[pixel]);
    if (keeps(kBackFaceChannel)) write_back_faces(c, row, &out_.back_face[pixel]);
    if (keeps(kAlbedoChannel))
      for (uint32_t i = 0; i < row.count; ++i) out_.albedo[pixel + i] = albedo(row.first + i, pixel + i, batch);
    write_motions(row, pixel, batch);
  }

  Vec3 albedo(uint32_t i, size_t pixel, const RayBatch& batch) const {
    const RayColumns& c = batch.columns;
    if (c.hit[i] == 0) return Vec3(0);
    const auto triangle = static_cast<uint32_t>(c.triangle[i]);
    const uint32_t material = batch.triangles.materials()[triangle];
    if (const Material& m = materials_[material]; m.albedo_texture == kNoTexture) return m.albedo;
    const float width = pixel_width(now_.projection(), out_.pixel_spread, out_.view_z[pixel]) * textures_.width_px *
                        static_cast<float>(space_.scale());
    return surface_albedo(source_, textures_.pyramids, batch.triangles.surface(triangle), material,
                          Vec2(c.u[i], c.v[i]), {Vec3(c.direction.at(i)), Vec3(c.normal.at(i)), width});
  }

  void write_motions(ColumnRow row, size_t pixel, const RayBatch& batch) const {
    const RayColumns& c = batch.columns;
    if (motion_.camera_moved()) {
      write_motion(c, row, &out_.motion_px[pixel]);
      write_numbers(c.previous_z, c, row, &out_.previous_z[pixel]);
    } else {
      std::fill_n(&out_.motion_px[pixel], row.count, Vec2(0));
      if (motion_.any()) std::copy_n(&out_.view_z[pixel], row.count, &out_.previous_z[pixel]);
    }
    if (!motion_.of_surfaces()) return;
    for (uint32_t i = row.first; i < row.first + row.count; ++i, ++pixel) {
      if (c.hit[i] == 0) continue;
      const HitSurface& surface = batch.triangles.surface(static_cast<uint32_t>(c.triangle[i]));
      std::tie(out_.motion_px[pixel], out_.previous_z[pixel]) =
          motion_.of({batch.hits[batch.ray_of(i)], surface, out_.view_z[pixel], i, c});
    }
  }

  const SceneSource& source_;
  const RayTracer& tracer_;
  const UnitSpace space_;
  const PrimaryCamera& now_;
  const SurfaceMotion motion_;
  const std::span<const Material> materials_;
  const TextureFilter textures_;
  GBuffer& out_;
  uint32_t left_ = 0, top_ = 0;        ///< pixel of the image at which out_ begins
  std::vector<RayHit> view_hits_;      ///< of trace_spans()
  std::span<const RayHit> pixel_hits_; ///< of out_.on_gpu, by pixel
};

} // namespace

bool approach_scene(CameraRay& ray) {
  constexpr double kNear = UnitSpace::kNear;
  if (glm::dot(ray.origin, ray.origin) <= kNear * kNear) return true;
  const double closest = -glm::dot(ray.origin, ray.direction);
  const DVec3 point = ray.origin + ray.direction * closest;
  if (closest > 0.0 && glm::dot(point, point) <= kNear * kNear) {
    ray.origin = point - ray.direction * kNear;
    return true;
  }
  ray.origin = DVec3(0.0);
  return false;
}

float pixel_width(const PrimaryCamera& camera, float view_z) {
  return pixel_width(camera.projection(), static_cast<float>(camera.pixel_spread()), view_z);
}

void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PreviousFrame& previous, GBuffer& gbuffer, Progress& progress, const TextureFilter& textures) {
  gbuffer.points_on_gpu = gbuffer.guides_on_gpu = false;
  gbuffer.make_room(now.size());
  gbuffer.pixel_spread = static_cast<float>(now.pixel_spread());
  PrimaryTracer primary(source, tracer, now, previous, textures, gbuffer);
  gbuffer.previous_z.resize(primary.sees_motion() ? now.size().pixels() : 0);
  progress.begin("primary rays", now.size().pixels());
  if (const auto* view = dynamic_cast<const ViewTracer*>(&tracer)) {
    if (primary.trace_view(*view, previous, progress)) return progress.advance(now.size().pixels());
  } else {
    gbuffer.on_gpu = nullptr;
  }
  for_each_tile(now.size(), progress, [&](const Tile& tile) { primary.trace_tile(tile); });
}

std::optional<CameraHit> trace_pixel(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera,
                                     uint32_t x, uint32_t y) {
  const ImageSize size = camera.size();
  const uint32_t x0 = x - x % kTileSize, y0 = y - y % kTileSize;
  const Tile tile{x0, y0, std::min(x0 + kTileSize, size.width), std::min(y0 + kTileSize, size.height)};
  GBuffer g;
  g.resize({tile.x1 - x0, tile.y1 - y0});
  PrimaryTracer primary(source, tracer, camera, PreviousFrame{camera}, {}, g);
  primary.begin_at(x0, y0);
  primary.trace_tile(tile);
  const size_t at = size_t{y - y0} * g.size.width + (x - x0);
  if (g.instance[at] == kNoInstance) return std::nullopt;
  return CameraHit{g.position[at], g.instance[at], g.triangle[at], g.material[at], g.back_face[at] != 0};
}

void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress) {
  trace_primary(source, tracer, now, PreviousFrame{previous}, gbuffer, progress);
}

} // namespace packtrace
