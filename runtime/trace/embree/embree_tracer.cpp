#include "runtime/trace/embree/embree_tracer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <string>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/cpu.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/progress.h"
#include "runtime/trace/embree/embree_device.h"
#include "runtime/trace/placement.h"
#include "runtime/trace/source/alpha_filter.h"

namespace packtrace {
namespace {

constexpr size_t kPaddingVertices = 2;

// A class is a combination of camera_visible, occludes, needs_mask and is_sliver(); the first two bits are also the
// Embree geometry mask.
constexpr uint32_t kMaskedClass = 1u << 2;
constexpr uint32_t kSliverClass = 1u << 3;
constexpr uint32_t kClassCount = 16;

uint32_t material_class(MaterialFlags flags) {
  return (camera_visible(flags) ? kCameraRays : 0u) | (occludes(flags) ? kOcclusionRays : 0u) |
         (needs_mask(flags) ? kMaskedClass : 0u);
}

/// Whether Embree's float normal may tilt a triangle so far that a ray that starts above it hits it. Edges of length L
/// have rounding errors of eps L, which tilt the normal by about eps L / h, h being the height over the longest edge,
/// and move the plane by eps L^2 / h at its far end. Ray offsets cover a few eps of the largest coordinate.
bool is_sliver(const DVec3& a, const DVec3& b, const DVec3& c) {
  constexpr double kCovered = 8.0;
  const double longest2 = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
  const DVec3 largest = glm::max(glm::max(glm::abs(a), glm::abs(b)), glm::abs(c));
  const double twice_area = glm::length(glm::cross(b - a, c - a));
  return longest2 * std::sqrt(longest2) > kCovered * std::max({largest.x, largest.y, largest.z}) * twice_area;
}

bool is_identity(const Affine& m) { return m == Affine(1.0f); }

/// Building takes seconds but reports no phases, so cancellation is checked explicitly.
void stop_if_cancelled() { Progress().check_cancelled(); }

std::string geometry_label(uint32_t geometry) { return "geometry " + std::to_string(geometry); }

} // namespace

/// The triangles of one surface that have the same class; the user data of one RTCGeometry.
struct EmbreeTracer::Part {
  const EmbreeTracer* tracer = nullptr;
  uint32_t surface = 0;
  uint32_t material_class = 0;
  std::vector<Triangle> triangles;
  std::vector<uint32_t> source_triangles; ///< by triangle: its number in the geometry; empty if that is the same

  uint32_t source_triangle(uint32_t i) const { return source_triangles.empty() ? i : source_triangles[i]; }

  /// Whether a ray hits the plane of a triangle in double precision where its interval begins or later. Occlusion rays
  /// must hit the triangle itself, too: rounding must not let a ray hit the face beyond the edge that it starts beside.
  /// For camera rays Embree decides, so that none slips between a sliver and its neighbours.
  bool is_hit_ahead(const RTCFilterFunctionNArguments* args, uint32_t i) const {
    const std::vector<Vec3>& positions = tracer->surfaces_[surface].positions;
    const Triangle& t = triangles[RTCHitN_primID(args->hit, args->N, i)];
    const DVec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
    const DVec3 origin(RTCRayN_org_x(args->ray, args->N, i), RTCRayN_org_y(args->ray, args->N, i),
                       RTCRayN_org_z(args->ray, args->N, i));
    const DVec3 direction(RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                          RTCRayN_dir_z(args->ray, args->N, i));
    const DVec3 to_a = a - origin, to_b = b - origin, to_c = c - origin;
    const DVec3 normal = glm::cross(b - a, c - a);
    const double distance = glm::dot(normal, to_a) / glm::dot(normal, direction); // NaN for a ray in the plane
    if (!(distance >= static_cast<double>(RTCRayN_tnear(args->ray, args->N, i)))) return false;
    if ((RTCRayN_mask(args->ray, args->N, i) & kOcclusionRays) == 0) return true;
    const double u = glm::dot(direction, glm::cross(to_b, to_c)), v = glm::dot(direction, glm::cross(to_c, to_a)),
                 w = glm::dot(direction, glm::cross(to_a, to_b));
    return (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
  }

  /// Embree filter function: rejects hits where an alpha mask removes the surface, and hits of slivers that
  /// is_hit_ahead() rejects.
  static void filter(const RTCFilterFunctionNArguments* args) {
    const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
    for (uint32_t i = 0; i < args->N; ++i) {
      if (args->valid[i] != -1) continue;
      if ((part.material_class & kSliverClass) != 0 && !part.is_hit_ahead(args, i)) args->valid[i] = 0;
      if ((part.material_class & kMaskedClass) == 0 || args->valid[i] != -1) continue;
      const uint32_t triangle = part.source_triangle(RTCHitN_primID(args->hit, args->N, i));
      const Vec2 barycentrics(RTCHitN_u(args->hit, args->N, i), RTCHitN_v(args->hit, args->N, i));
      const bool occlusion = (RTCRayN_mask(args->ray, args->N, i) & kOcclusionRays) != 0;
      const Attachment& attachment =
          part.tracer->attachment_of(RTCHitN_instID(args->hit, args->N, i, 0), RTCHitN_geomID(args->hit, args->N, i));
      const uint32_t instance = part.tracer->placements_[attachment.placement].instance;
      if (!surface_present(part.tracer->source_, instance, triangle, barycentrics, occlusion)) args->valid[i] = 0;
    }
  }
};

/// The Embree objects. The order matters: members are destroyed in reverse.
struct EmbreeTracer::Device {
  explicit Device(const EmbreeConfig& config) : embree(config.memory) {}

  EmbreeDevice embree;
  std::vector<RtcPtr<RTCSceneTy>> surface_scenes; ///< by surface; null unless the surface is instanced
  RtcPtr<RTCSceneTy> top;

  RtcPtr<RTCSceneTy> new_scene(const EmbreeConfig& config) {
    RtcPtr<RTCSceneTy> scene(rtcNewScene(embree.get()));
    embree.check();
    const bool high = config.quality == BvhQuality::kHigh;
    rtcSetSceneBuildQuality(scene.get(), high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
    const int flags =
        (config.robust ? RTC_SCENE_FLAG_ROBUST : 0) | (config.compact ? RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_NONE);
    rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(flags));
    rtcSetSceneProgressMonitorFunction(scene.get(), [](void*, double) { return !Progress::cancelled(); }, nullptr);
    return scene;
  }

  uint32_t attach(RTCScene scene, RtcPtr<RTCGeometryTy> geometry) {
    rtcCommitGeometry(geometry.get());
    const uint32_t id = rtcAttachGeometry(scene, geometry.get());
    embree.check();
    return id;
  }

  uint32_t attach_part(RTCScene scene, Part& part, const Surface& surface) {
    RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(embree.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    embree.check();
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, surface.positions.data(),
                               0, sizeof(Vec3), surface.positions.size() - kPaddingVertices);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, part.triangles.data(), 0,
                               sizeof(Triangle), part.triangles.size());
    rtcSetGeometryMask(geometry.get(), part.material_class & (kCameraRays | kOcclusionRays));
    rtcSetGeometryUserData(geometry.get(), &part);
    if ((part.material_class & (kMaskedClass | kSliverClass)) != 0) {
      rtcSetGeometryIntersectFilterFunction(geometry.get(), Part::filter);
      rtcSetGeometryOccludedFilterFunction(geometry.get(), Part::filter);
    }
    return attach(scene, std::move(geometry));
  }

  uint32_t attach_instance(RTCScene instanced, const Affine& unit_from_surface, uint32_t ray_mask) {
    RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(embree.get(), RTC_GEOMETRY_TYPE_INSTANCE));
    embree.check();
    rtcSetGeometryInstancedScene(geometry.get(), instanced);
    rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &unit_from_surface[0][0]);
    rtcSetGeometryMask(geometry.get(), ray_mask);
    return attach(top.get(), std::move(geometry));
  }
};

/// A geometry as decoded by the source.
struct EmbreeTracer::Decoded {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  Bounds bounds;
  uint32_t uses = 0;

  /// Fills and checks positions, triangles and bounds. Throws Error(kInput) for positions that are not finite or
  /// indices out of range.
  void read(const SceneSource& source, uint32_t geometry) {
    const GeometryCounts counts = source.counts(geometry);
    positions.resize(counts.vertices);
    triangles.resize(counts.triangles);
    source.decode(geometry, positions, triangles);
    bounds = bounds_of(positions);
    if (!positions.empty() && !std::all_of(positions.begin(), positions.end(), [](Vec3 p) { return is_finite(p); }))
      throw Error(ErrorKind::kInput, geometry_label(geometry) + " has positions beyond the range of float");
    const auto in_range = [&](const Triangle& t) { return std::max({t.x, t.y, t.z}) < counts.vertices; };
    if (!std::all_of(triangles.begin(), triangles.end(), in_range))
      throw Error(ErrorKind::kInput, geometry_label(geometry) + " has a triangle with a vertex out of range");
  }
};

namespace {

uint64_t surface_bytes(const GeometryCounts& counts) {
  return uint64_t{counts.vertices} * sizeof(Vec3) + uint64_t{counts.triangles} * (sizeof(Triangle) + sizeof(uint32_t));
}

} // namespace

EmbreeTracer::EmbreeTracer(const SceneSource& source, EmbreeConfig config)
    : source_(source), config_(config), device_(std::make_unique<Device>(config)) {
  if (config.memory) memory_ = MemoryReservation(*config.memory);
  std::vector<Decoded> decoded(source.geometry_count());
  for (const PlacedGeometry& placed : source.instances()) {
    if (placed.geometry >= decoded.size()) throw Error(ErrorKind::kInput, "an instance has no geometry");
    ++decoded[placed.geometry].uses;
  }
  uint64_t decoded_bytes = 0;
  for (uint32_t g = 0; g < decoded.size(); ++g)
    if (decoded[g].uses > 0) decoded_bytes += surface_bytes(source.counts(g));
  MemoryReservation decoding = config.memory ? MemoryReservation(*config.memory) : MemoryReservation();
  decoding.resize(decoded_bytes, "decoding the scene for Embree");
  tbb::parallel_for(uint32_t{0}, source.geometry_count(), [&](uint32_t g) {
    stop_if_cancelled();
    if (decoded[g].uses > 0 && source.counts(g).triangles > 0) decoded[g].read(source, g);
  });
  place(decoded);
  stop_if_cancelled();
  attach();
}

EmbreeTracer::~EmbreeTracer() = default;

/// Chooses the unit spaces and creates surfaces, their parts and placements.
void EmbreeTracer::place(std::vector<Decoded>& decoded) {
  const std::span<const PlacedGeometry> instances = source_.instances();
  std::vector<Bounds> bounds;
  for (const Decoded& geometry : decoded) bounds.push_back(geometry.bounds);
  space_ = UnitSpace(placed_bounds(source_, bounds));

  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> instanced_surface(decoded.size(), kNone);
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t g = instances[i].geometry;
    if (decoded[g].triangles.empty()) continue;
    const DAffine world_from_object(instances[i].world_from_object);
    const DAffine unit_from_object = compose(space_.unit_from_outer(), world_from_object);
    const UnitSpace own(decoded[g].bounds);
    const DAffine unit_from_own = compose(unit_from_object, own.outer_from_unit());
    const bool direct = decoded[g].uses == 1 && is_identity(instances[i].world_from_object);
    if (direct || !traceable_as_instance(unit_from_own)) {
      placements_.push_back(direct_placement(i, world_from_object));
      surface_of_placement_.push_back(add_surface(i, decoded[g], unit_from_object));
    } else {
      if (instanced_surface[g] == kNone) instanced_surface[g] = add_surface(i, decoded[g], own.unit_from_outer());
      placements_.push_back(instanced_placement(i, world_from_object, unit_from_own));
      surface_of_placement_.push_back(instanced_surface[g]);
    }
    if (decoded[g].uses == 1) decoded[g] = Decoded{};
  }
}

uint32_t EmbreeTracer::add_surface(uint32_t instance, const Decoded& decoded, const DAffine& surface_from_object) {
  const auto index = static_cast<uint32_t>(surfaces_.size());
  memory_.resize(memory_.bytes() + surface_bytes(source_.counts(source_.instances()[instance].geometry)),
                 "Embree's copy of the triangles");
  Surface& surface = surfaces_.emplace_back();
  surface.geometry = source_.instances()[instance].geometry;
  surface.positions.resize(decoded.positions.size() + kPaddingVertices, Vec3(0));
  tbb::parallel_for(tbb::blocked_range<size_t>(0, decoded.positions.size(), 65536), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i)
      surface.positions[i] = Vec3(transform_point(surface_from_object, DVec3(decoded.positions[i])));
  });
  split_parts(index, decoded.triangles, instance);
  return index;
}

/// Splits a surface's triangles into one part per class; invisible triangles are dropped.
/// @param instance any instance of the geometry: classes are the same in all of them
void EmbreeTracer::split_parts(uint32_t surface, const std::vector<Triangle>& triangles, uint32_t instance) {
  const std::span<const Material> materials = source_.materials();
  Surface& out = surfaces_[surface];
  std::array<Part, kClassCount> by_class;
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    const uint32_t material = source_.material_of(instance, t);
    if (material >= materials.size())
      throw Error(ErrorKind::kInput, geometry_label(out.geometry) + " has a triangle without a material");
    const auto corner = [&](uint32_t vertex) { return DVec3(out.positions[vertex]); };
    const Triangle& corners = triangles[t];
    const bool sliver = config_.check_slivers && is_sliver(corner(corners.x), corner(corners.y), corner(corners.z));
    Part& part = by_class[material_class(materials[material].flags) | (sliver ? kSliverClass : 0u)];
    part.triangles.push_back(triangles[t]);
    part.source_triangles.push_back(t);
  }
  out.first_part = static_cast<uint32_t>(parts_.size());
  for (uint32_t c = 0; c < kClassCount; ++c) {
    Part& part = by_class[c];
    if (part.triangles.empty() || (c & (kCameraRays | kOcclusionRays)) == 0) continue;
    if (part.triangles.size() == triangles.size()) part.source_triangles = {};
    part.triangles.shrink_to_fit();
    part.source_triangles.shrink_to_fit();
    part.tracer = this;
    part.surface = surface;
    part.material_class = c;
    parts_.push_back(std::move(part));
    ++out.part_count;
  }
}

/// Attaches all surfaces to the top scene and builds all trees.
void EmbreeTracer::attach() {
  Device& device = *device_;
  device.top = device.new_scene(config_);
  device.surface_scenes.resize(surfaces_.size());
  for (uint32_t p = 0; p < placements_.size(); ++p) attach_surface(p, surface_of_placement_[p]);
  commit(device.top.get(), kNoGeometry);
}

void EmbreeTracer::commit(RTCSceneTy* scene, uint32_t geometry) {
  EmbreeDevice& embree = device_->embree;
  const uint64_t before = embree.bytes();
  embree.start_peak();
  rtcCommitScene(scene);
  embree.check();
  tree_bytes_.push_back({geometry, embree.peak_bytes() - before, embree.bytes() - std::min(before, embree.bytes())});
}

void EmbreeTracer::attach_surface(uint32_t placement, uint32_t surface_index) {
  Device& device = *device_;
  const Surface& surface = surfaces_[surface_index];
  if (surface.part_count == 0) return;
  const auto remember = [&](uint32_t id, uint32_t part) {
    if (attachments_.size() <= id) attachments_.resize(id + 1);
    attachments_[id] = {placement, part};
  };
  if (!placements_[placement].instanced) {
    for (uint32_t i = surface.first_part; i < surface.first_part + surface.part_count; ++i)
      remember(device.attach_part(device.top.get(), parts_[i], surface), i);
    return;
  }
  RtcPtr<RTCSceneTy>& child = device.surface_scenes[surface_index];
  if (!child) {
    child = device.new_scene(config_);
    for (uint32_t i = 0; i < surface.part_count; ++i)
      // Embree's geometry ids count up from 0.
      device.attach_part(child.get(), parts_[surface.first_part + i], surface);
    commit(child.get(), surface.geometry);
  }
  uint32_t ray_mask = 0;
  for (uint32_t i = 0; i < surface.part_count; ++i)
    ray_mask |= parts_[surface.first_part + i].material_class & (kCameraRays | kOcclusionRays);
  const Affine unit_from_surface(placements_[placement].unit_from_surface);
  remember(device.attach_instance(child.get(), unit_from_surface, ray_mask), surface.first_part);
}

RTCSceneTy* EmbreeTracer::handle() const { return device_->top.get(); }

/// Derives the instruction set from the ray widths that Embree supports; Embree does not report its name.
std::string_view EmbreeTracer::isa() const {
  const auto wide = [&](RTCDeviceProperty property) { return rtcGetDeviceProperty(device_->embree.get(), property); };
  if (wide(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) return "avx512";
  if (wide(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) return cpu_has_avx2() ? "avx2" : "avx";
  return "sse";
}

HitSurface EmbreeTracer::resolve(const RayHit& hit) const {
  const Part& part = parts_[hit.part];
  const Surface& surface = surfaces_[part.surface];
  const Triangle& t = part.triangles[hit.triangle];
  return {&placements_[hit.placement],
          surface.geometry,
          part.source_triangle(hit.triangle),
          {surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]}};
}

std::vector<ResidentPart> EmbreeTracer::resident() const {
  uint64_t vertices = 0, indices = 0;
  uint64_t tables = placements_.size() * (sizeof(Placement) + sizeof(uint32_t)) +
                    attachments_.size() * sizeof(Attachment) + parts_.size() * sizeof(Part) +
                    surfaces_.size() * sizeof(Surface);
  for (const Surface& surface : surfaces_) vertices += surface.positions.size() * sizeof(Vec3);
  for (const Part& part : parts_) {
    indices += part.triangles.size() * sizeof(Triangle);
    tables += part.source_triangles.size() * sizeof(uint32_t);
  }
  return {{"bvh", device_->embree.bytes()}, {"vertices", vertices}, {"indices", indices}, {"tables", tables}};
}

} // namespace packtrace
