#include "runtime/camera/primary_visibility.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <vector>

#include "runtime/camera/device_surfaces.h"
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

/// The rays of a row of blocks. Pixels of a block outside the image get rays that hit nothing (tfar < tnear).
struct RayBatch {
  uint32_t count = 0;
  RayColumns columns;
  Ray rays[kBatch];
  RayHit hits[kBatch];
  HitSurface surfaces[kBatch];
  uint32_t hit_count = 0;
  uint32_t hit_rays[kBatch]; ///< by hit: index of its ray
  SurfaceQuery places[kBatch];
  SurfaceAttributes attributes[kBatch];
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
        textures_(textures), out_(out) {}

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

  /// Sets the pixel of the image that the first pixel of the G-buffer stands for.
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
      for (uint32_t i = 0; i < batch.count; ++i)
        batch.hits[i] = is_inside(i, tile, batch) ? pixel_hits_[pixel_of(i, batch)] : RayHit{};
    } else {
      tracer_.closest_hits({batch.rays, batch.count}, kCameraRays, RayOrder::kCoherent, {batch.hits, batch.count});
    }
  }

  static bool is_inside(uint32_t i, const Tile& tile, const RayBatch& batch) {
    return batch.columns.x[i] < tile.x1 && batch.columns.y[i] < tile.y1;
  }

  void trace_row(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    make_rays(y0, tile, batch);
    find_hits(y0, tile, batch);
    batch.hit_count = 0;
    for (uint32_t i = 0; i < batch.count; ++i) {
      if (batch.hits[i].valid())
        add_hit(i, batch);
      else
        fill_in(i, batch.columns);
    }
    source_.look_up({batch.places, batch.hit_count}, {batch.attributes, batch.hit_count});
    place_hits(batch);
    for (uint32_t i = 0; i < batch.count; ++i)
      if (!batch.hits[i].valid() && is_inside(i, tile, batch)) write_miss(pixel_of(i, batch));
    for (uint32_t h = 0; h < batch.hit_count; ++h) write_hit(h, batch);
  }

  /// Place of a tile's row of blocks in the rays of the whole picture.
  size_t place_of(uint32_t y0, const Tile& tile) const {
    const size_t columns = (out_.size.width + kTileSize - 1) / kTileSize;
    const size_t number = tile.y0 / kTileSize * columns + tile.x0 / kTileSize;
    return (number * kTileRows + (y0 - tile.y0) / kBlock) * kBatch;
  }

  void make_rays(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    RayColumns& c = batch.columns;
    batch.count = 0;
    for (uint32_t x = tile.x0; x < tile.x1; x += kBlock)
      for (uint32_t i = 0; i < kBlock * kBlock; ++i, ++batch.count)
        c.x[batch.count] = x + i % kBlock, c.y[batch.count] = y0 + i / kBlock;
    write_rays(now_, space_, batch.count, c);
    for (uint32_t i = 0; i < batch.count; ++i) {
      CameraRay ray{c.origin.at(i), c.direction.at(i)};
      const bool traced = approach_scene(ray) && is_inside(i, tile, batch);
      c.origin.set(i, ray.origin);
      batch.rays[i] = {Vec3(ray.origin), 0.0f, Vec3(ray.direction),
                       traced ? std::numeric_limits<float>::infinity() : -1.0f};
    }
  }

  bool keeps(GBufferChannel channel) const { return (out_.channels & channel) != 0; }

  size_t pixel_of(uint32_t i, const RayBatch& batch) const {
    return static_cast<size_t>(batch.columns.y[i] - top_) * out_.size.width + (batch.columns.x[i] - left_);
  }

  void add_hit(uint32_t i, RayBatch& batch) const {
    RayColumns& c = batch.columns;
    const uint32_t h = batch.hit_count++;
    batch.hit_rays[h] = i;
    const HitSurface& hit = batch.surfaces[i] = surface_of(i, h, batch);
    batch.places[h] = {hit.placement->instance, hit.triangle, Vec2(batch.hits[i].u, batch.hits[i].v)};
    for (int corner = 0; corner < 3; ++corner)
      for (int axis = 0; axis < 3; ++axis) c.vertex[corner][axis][i] = hit.vertices[corner][axis];
    c.u[i] = batch.hits[i].u, c.v[i] = batch.hits[i].v;
    c.instanced[i] = hit.placement->instanced;
    c.surface_offset[i] = 0.0;
  }

  /// Decodes the surface that a ray hit, unless the hit before was on the same triangle.
  /// @param h number of hits before
  HitSurface surface_of(uint32_t i, uint32_t h, const RayBatch& batch) const {
    const RayHit& hit = batch.hits[i];
    if (h > 0) {
      const uint32_t last = batch.hit_rays[h - 1];
      const RayHit& before = batch.hits[last];
      if (hit.triangle == before.triangle && hit.part == before.part && hit.placement == before.placement)
        return batch.surfaces[last];
    }
    return tracer_.resolve(hit);
  }

  /// Sets what vectorised loops read of a ray that missed.
  static void fill_in(uint32_t i, RayColumns& c) {
    for (int corner = 0; corner < 3; ++corner)
      for (int axis = 0; axis < 3; ++axis) c.vertex[corner][axis][i] = 0.0f;
    c.u[i] = c.v[i] = 0.0f;
    c.instanced[i] = 0;
    c.surface_offset[i] = 0.0;
  }

  /// Computes the surface points of all hits.
  void place_hits(RayBatch& batch) const {
    RayColumns& c = batch.columns;
    span_triangles(batch.count, c);
    for (uint32_t h = 0; h < batch.hit_count; ++h) {
      const uint32_t i = batch.hit_rays[h];
      if (c.instanced[i] == 0) continue;
      const Placement& placement = *batch.surfaces[i].placement;
      c.own_normal.set(i, placement.surface_normal * c.own_normal.at(i));
      c.from_barycentrics.set(i, transform_point(placement.unit_from_surface, c.from_barycentrics.at(i)));
    }
    meet_planes(batch.count, c);
    for (uint32_t h = 0; h < batch.hit_count; ++h)
      if (const uint32_t i = batch.hit_rays[h]; c.instanced[i] != 0)
        c.surface_offset[i] = surface_offset(batch.surfaces[i], c.point.at(i), c.normal.at(i));
    place_points(now_, space_, batch.count, c);
    if (motion_.any()) motion_.move_with_camera(batch.count, c);
  }

  void write_miss(size_t pixel) const {
    out_.view_z[pixel] = 0.0f;
    out_.position[pixel] = out_.geometric_normal[pixel] = out_.normal[pixel] = Vec3(0);
    out_.instance[pixel] = kNoInstance;
    if (keeps(kAlbedoChannel)) out_.albedo[pixel] = Vec3(0);
    if (keeps(kTriangleChannel)) out_.triangle[pixel] = 0;
    if (keeps(kMaterialChannel)) out_.material[pixel] = 0;
    if (keeps(kBackFaceChannel)) out_.back_face[pixel] = 0;
    out_.offset[pixel] = 0.0f;
    out_.motion_px[pixel] = Vec2(0);
    if (motion_.any()) out_.previous_z[pixel] = 0.0f;
  }

  void write_hit(uint32_t h, const RayBatch& batch) const {
    const uint32_t i = batch.hit_rays[h];
    const RayColumns& c = batch.columns;
    const HitSurface& hit = batch.surfaces[i];
    const SurfaceAttributes& attributes = batch.attributes[h];
    const size_t pixel = pixel_of(i, batch);
    const DVec3 facing = c.normal.at(i);
    const float view_z = std::max(static_cast<float>(c.view_z[i]), std::numeric_limits<float>::denorm_min());

    out_.view_z[pixel] = view_z;
    out_.position[pixel] = Vec3(c.position.at(i));
    out_.geometric_normal[pixel] = Vec3(facing);
    out_.normal[pixel] = shading_normal(attributes, *hit.placement, facing);
    if (keeps(kAlbedoChannel)) {
      const float width = pixel_width(now_.projection(), out_.pixel_spread, view_z) * textures_.width_px *
                          static_cast<float>(space_.scale());
      out_.albedo[pixel] = surface_albedo(source_, textures_.pyramids, hit, attributes.material, Vec2(c.u[i], c.v[i]),
                                          {batch.rays[i].direction, Vec3(facing), width});
    }
    out_.instance[pixel] = hit.placement->instance;
    if (keeps(kTriangleChannel)) out_.triangle[pixel] = hit.triangle;
    if (keeps(kMaterialChannel)) out_.material[pixel] = attributes.material;
    if (keeps(kBackFaceChannel)) out_.back_face[pixel] = glm::dot(c.own_normal.at(i), facing) < 0.0;
    out_.offset[pixel] = static_cast<float>(c.offset[i]);
    if (motion_.any())
      std::tie(out_.motion_px[pixel], out_.previous_z[pixel]) = motion_.of({batch.hits[i], hit, view_z, i, c});
    else
      out_.motion_px[pixel] = Vec2(0);
  }

  static Vec3 shading_normal(const SurfaceAttributes& attributes, const Placement& placement, DVec3 geometric) {
    if (!attributes.has_normal) return Vec3(geometric);
    const DVec3 normal = placement.object_normal * DVec3(attributes.normal);
    const double length = glm::length(normal);
    if (!(length > 0.0)) return Vec3(geometric);
    return Vec3(normal * ((glm::dot(normal, geometric) < 0.0 ? -1.0 : 1.0) / length));
  }

  const SceneSource& source_;
  const RayTracer& tracer_;
  const UnitSpace space_;
  const PrimaryCamera& now_;
  const SurfaceMotion motion_;
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
  gbuffer.points_on_gpu = false;
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
