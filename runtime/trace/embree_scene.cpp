#include "runtime/trace/embree_scene.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <xmmintrin.h>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/progress.h"
#include "runtime/trace/alpha_filter.h"
#include "runtime/trace/embree_device.h"

namespace packtrace {
namespace {

constexpr unsigned int kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040; // bits of MXCSR
constexpr size_t kPaddingVertices = 2;

// Combinations of camera_visible, occludes, needs_mask; the first two are the Embree geometry mask.
constexpr uint32_t kMaskedClass = 1u << 2;
constexpr uint32_t kClassCount = 8;

uint32_t material_class(MaterialFlags flags) {
  return (camera_visible(flags) ? kCameraRays : 0u) | (occludes(flags) ? kOcclusionRays : 0u) |
         (needs_mask(flags) ? kMaskedClass : 0u);
}

double norm(const glm::dmat3& m) {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

/// Whether Embree's float inverse of a placement leaves enough digits to hit surfaces where they are.
bool traceable_as_instance(const DAffine& unit_from_surface) {
  constexpr double kMaxNorm = 1e12, kMaxCondition = 65536.0;
  const glm::dmat3 linear(unit_from_surface);
  const glm::dmat3 inverted = glm::inverse(linear);
  const double forward = norm(linear), backward = norm(inverted);
  return forward <= kMaxNorm && backward <= kMaxNorm && forward * backward <= kMaxCondition; // false for NaN
}

glm::dmat3 absolute(const glm::dmat3& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])}; }

bool is_identity(const Affine& m) { return m == Affine(1.0f); }

/// Building has no phases to show, but takes seconds.
void stop_if_cancelled() { Progress().check_cancelled(); }

std::string geometry_label(uint32_t geometry) { return "geometry " + std::to_string(geometry); }

} // namespace

FlushDenormals::FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero); }
FlushDenormals::~FlushDenormals() { _mm_setcsr(saved_); }

/// Triangles of one surface with the same class; the user data of one RTCGeometry.
struct EmbreeScene::Part {
  const EmbreeScene* scene = nullptr;
  uint32_t geometry = 0;
  uint32_t material_class = 0;
  std::vector<Triangle> triangles;
  std::vector<uint32_t> source_triangles; ///< numbers in the geometry; empty: the same as here

  uint32_t source_triangle(uint32_t i) const { return source_triangles.empty() ? i : source_triangles[i]; }

  /// Embree filter function: rejects hits where the surface is absent.
  static void filter(const RTCFilterFunctionNArguments* args) {
    const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
    for (uint32_t i = 0; i < args->N; ++i) {
      if (args->valid[i] != -1) continue;
      const uint32_t triangle = part.source_triangle(RTCHitN_primID(args->hit, args->N, i));
      const Vec2 barycentrics(RTCHitN_u(args->hit, args->N, i), RTCHitN_v(args->hit, args->N, i));
      const bool occlusion = (RTCRayN_mask(args->ray, args->N, i) & kOcclusionRays) != 0;
      const Attachment& attachment =
          part.scene->attachment_of(RTCHitN_instID(args->hit, args->N, i, 0), RTCHitN_geomID(args->hit, args->N, i));
      const uint32_t instance = part.scene->placements_[attachment.placement].instance;
      if (!surface_present(part.scene->source_, instance, triangle, barycentrics, occlusion)) args->valid[i] = 0;
    }
  }
};

/// The Embree objects, in the order in which they must not be destroyed.
struct EmbreeScene::Device {
  EmbreeDevice embree;
  std::vector<RtcPtr<RTCSceneTy>> surface_scenes; ///< of instanced surfaces, by surface; else null
  RtcPtr<RTCSceneTy> top;

  RtcPtr<RTCSceneTy> new_scene(const EmbreeConfig& config) {
    RtcPtr<RTCSceneTy> scene(rtcNewScene(embree.get()));
    embree.check();
    const bool high = config.quality == BvhQuality::kHigh;
    rtcSetSceneBuildQuality(scene.get(), high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(scene.get(), config.robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneProgressMonitorFunction(
        scene.get(), [](void*, double) { return !Progress::cancelled(); }, nullptr);
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
    if (part.material_class & kMaskedClass) {
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

/// A geometry as the source gives it.
struct EmbreeScene::Decoded {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  Bounds bounds;
  uint32_t uses = 0;

  /// Fills positions, triangles and bounds, and checks them.
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

EmbreeScene::EmbreeScene(const SceneSource& source, EmbreeConfig config)
    : source_(source), config_(config), device_(std::make_unique<Device>()) {
  std::vector<Decoded> decoded(source.geometry_count());
  for (const PlacedGeometry& placed : source.instances()) {
    if (placed.geometry >= decoded.size()) throw Error(ErrorKind::kInput, "an instance has no geometry");
    ++decoded[placed.geometry].uses;
  }
  tbb::parallel_for(uint32_t{0}, source.geometry_count(), [&](uint32_t g) {
    stop_if_cancelled();
    if (decoded[g].uses > 0 && source.counts(g).triangles > 0) decoded[g].read(source, g);
  });
  place(decoded);
  stop_if_cancelled();
  attach();
}

EmbreeScene::~EmbreeScene() = default;

/// Chooses the unit spaces and makes surfaces, their parts and placements.
void EmbreeScene::place(std::vector<Decoded>& decoded) {
  const std::span<const PlacedGeometry> instances = source_.instances();
  Bounds world;
  for (size_t i = 0; i < instances.size(); ++i) {
    const DAffine world_from_object(instances[i].world_from_object);
    if (!std::isfinite(norm(glm::dmat3(world_from_object))) || !is_finite(DVec3(world_from_object[3])))
      throw Error(ErrorKind::kInput, "the transform of instance " + std::to_string(i) + " is not finite");
    const Bounds box = transform_bounds(world_from_object, decoded[instances[i].geometry].bounds);
    if (!box.empty()) world.extend(box);
  }
  space_ = UnitSpace(world);

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

    Placement placement;
    placement.instance = i;
    placement.object_normal = normal_matrix(world_from_object);
    if (direct || !traceable_as_instance(unit_from_own)) {
      placement.surface = add_surface(i, decoded[g], unit_from_object);
    } else {
      if (instanced_surface[g] == kNone) instanced_surface[g] = add_surface(i, decoded[g], own.unit_from_outer());
      placement.surface = instanced_surface[g];
      placement.instanced = true;
      placement.unit_from_surface = unit_from_own;
      placement.surface_normal = normal_matrix(unit_from_own);
      const DAffine own_from_unit = inverse(unit_from_own);
      const glm::dmat3 inverted(own_from_unit);
      const glm::dmat3 growth = absolute(inverted) * absolute(glm::dmat3(unit_from_own));
      placement.moved_linear = growth * absolute(inverted);
      placement.moved_offset = growth * glm::abs(DVec3(own_from_unit[3]));
    }
    placements_.push_back(placement);
    if (decoded[g].uses == 1) decoded[g] = Decoded{};
  }
}

uint32_t EmbreeScene::add_surface(uint32_t instance, const Decoded& decoded, const DAffine& surface_from_object) {
  Surface surface;
  surface.geometry = source_.instances()[instance].geometry;
  surface.positions.resize(decoded.positions.size() + kPaddingVertices, Vec3(0));
  tbb::parallel_for(tbb::blocked_range<size_t>(0, decoded.positions.size(), 65536), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i)
      surface.positions[i] = Vec3(transform_point(surface_from_object, DVec3(decoded.positions[i])));
  });
  split_parts(surface, decoded.triangles, instance);
  surfaces_.push_back(std::move(surface));
  return static_cast<uint32_t>(surfaces_.size() - 1);
}

/// Sorts a surface's triangles into one part for each class of material; invisible ones go nowhere.
/// @param instance any that places it: classes are the same in all of them
void EmbreeScene::split_parts(Surface& surface, const std::vector<Triangle>& triangles, uint32_t instance) {
  const std::span<const Material> materials = source_.materials();
  std::array<Part, kClassCount> by_class;
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    const uint32_t material = source_.material_of(instance, t);
    if (material >= materials.size())
      throw Error(ErrorKind::kInput, geometry_label(surface.geometry) + " has a triangle without a material");
    Part& part = by_class[material_class(materials[material].flags)];
    part.triangles.push_back(triangles[t]);
    part.source_triangles.push_back(t);
  }
  surface.first_part = static_cast<uint32_t>(parts_.size());
  for (uint32_t c = 0; c < kClassCount; ++c) {
    Part& part = by_class[c];
    if (part.triangles.empty() || (c & (kCameraRays | kOcclusionRays)) == 0) continue;
    if (part.triangles.size() == triangles.size()) part.source_triangles = {};
    part.triangles.shrink_to_fit();
    part.source_triangles.shrink_to_fit();
    part.scene = this;
    part.geometry = surface.geometry;
    part.material_class = c;
    parts_.push_back(std::move(part));
    ++surface.part_count;
  }
}

/// Builds all trees.
void EmbreeScene::attach() {
  Device& device = *device_;
  device.top = device.new_scene(config_);
  device.surface_scenes.resize(surfaces_.size());
  for (uint32_t p = 0; p < placements_.size(); ++p) {
    const Placement& placement = placements_[p];
    const Surface& surface = surfaces_[placement.surface];
    const auto remember = [&](uint32_t id, uint32_t part) {
      if (attachments_.size() <= id) attachments_.resize(id + 1);
      attachments_[id] = {p, part};
    };
    if (!placement.instanced) {
      for (uint32_t i = surface.first_part; i < surface.first_part + surface.part_count; ++i)
        remember(device.attach_part(device.top.get(), parts_[i], surface), i);
      continue;
    }
    if (surface.part_count == 0) continue;
    RtcPtr<RTCSceneTy>& child = device.surface_scenes[placement.surface];
    if (!child) {
      child = device.new_scene(config_);
      for (uint32_t i = 0; i < surface.part_count; ++i)
        device.attach_part(child.get(), parts_[surface.first_part + i], surface); // ids count up from 0
      rtcCommitScene(child.get());
      device.embree.check();
    }
    uint32_t ray_mask = 0;
    for (uint32_t i = 0; i < surface.part_count; ++i)
      ray_mask |= parts_[surface.first_part + i].material_class & (kCameraRays | kOcclusionRays);
    remember(device.attach_instance(child.get(), Affine(placement.unit_from_surface), ray_mask), surface.first_part);
  }
  rtcCommitScene(device.top.get());
  device.embree.check();
}

RTCSceneTy* EmbreeScene::handle() const { return device_->top.get(); }

const EmbreeScene::Attachment& EmbreeScene::attachment_of(uint32_t instance, uint32_t geometry) const {
  return attachments_[instance != RTC_INVALID_GEOMETRY_ID ? instance : geometry];
}

EmbreeScene::Hit EmbreeScene::resolve(uint32_t instance, uint32_t geometry, uint32_t primitive) const {
  const bool instanced = instance != RTC_INVALID_GEOMETRY_ID;
  const Attachment& attachment = attachment_of(instance, geometry);
  const Part& part = parts_[attachment.part + (instanced ? geometry : 0u)];
  const Placement& placement = placements_[attachment.placement];
  const Vec3* positions = surfaces_[placement.surface].positions.data();
  const Triangle& t = part.triangles[primitive];
  return {
      &placement, part.geometry, part.source_triangle(primitive), {positions + t.x, positions + t.y, positions + t.z}};
}

uint64_t EmbreeScene::bvh_bytes() const { return device_->embree.bytes(); }

uint64_t EmbreeScene::resident_bytes() const {
  uint64_t bytes = bvh_bytes() + placements_.size() * sizeof(Placement) + attachments_.size() * sizeof(Attachment);
  for (const Surface& surface : surfaces_) bytes += surface.positions.size() * sizeof(Vec3);
  for (const Part& part : parts_)
    bytes += part.triangles.size() * sizeof(Triangle) + part.source_triangles.size() * sizeof(uint32_t);
  return bytes;
}

} // namespace packtrace
