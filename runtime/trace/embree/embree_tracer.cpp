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
#include "runtime/trace/embree/embree_parts.h"
#include "runtime/trace/placement.h"

namespace packtrace {
namespace {

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

uint64_t surface_bytes(const GeometryCounts& counts) {
  return uint64_t{counts.vertices} * sizeof(Vec3) + uint64_t{counts.triangles} * (sizeof(Triangle) + sizeof(uint32_t));
}

} // namespace

EmbreeTracer::EmbreeTracer(const SceneSource& source, EmbreeConfig config, const Movers& movers)
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
  place(decoded, movers);
  stop_if_cancelled();
  attach();
}

EmbreeTracer::~EmbreeTracer() = default;

/// Chooses the unit spaces and creates surfaces, their parts and placements.
void EmbreeTracer::place(std::vector<Decoded>& decoded, const Movers& movers) {
  const std::span<const PlacedGeometry> instances = source_.instances();
  std::vector<Bounds> bounds;
  for (const Decoded& geometry : decoded) bounds.push_back(geometry.bounds);
  movable_ = movable_instances(movers, instances.size());
  space_ = UnitSpace(bounds_of_motion(source_, bounds, movers));
  if (!movable_.empty()) {
    for (const PlacedGeometry& placed : instances) world_from_object_.push_back(placed.world_from_object);
    placement_of_.assign(instances.size(), kNoHit);
  }

  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> instanced_surface(decoded.size(), kNone);
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t g = instances[i].geometry;
    if (decoded[g].triangles.empty()) continue;
    const DAffine world_from_object(instances[i].world_from_object);
    const DAffine unit_from_object = compose(space_.unit_from_outer(), world_from_object);
    const UnitSpace own(decoded[g].bounds);
    const DAffine unit_from_own = compose(unit_from_object, own.outer_from_unit());
    const bool moves = !movable_.empty() && movable_[i] != 0;
    const bool direct = decoded[g].uses == 1 && is_identity(instances[i].world_from_object);
    if (!moves && (direct || !traceable_as_instance(unit_from_own))) {
      placements_.push_back(direct_placement(i, world_from_object));
      surface_of_placement_.push_back(add_surface(i, decoded[g], unit_from_object));
    } else {
      if (instanced_surface[g] == kNone) {
        instanced_surface[g] = add_surface(i, decoded[g], own.unit_from_outer());
        surfaces_.back().own = own;
        surfaces_.back().bounds = {own.to_unit(decoded[g].bounds.lo), own.to_unit(decoded[g].bounds.hi)};
      }
      placements_.push_back(instanced_placement(i, world_from_object, unit_from_own));
      surface_of_placement_.push_back(instanced_surface[g]);
    }
    if (moves) placement_of_[i] = static_cast<uint32_t>(placements_.size()) - 1;
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
  if (!movable_.empty()) {
    attachment_of_.assign(placements_.size(), kNoHit);
    hidden_.assign(placements_.size(), 0);
    for (uint32_t id = 0; id < attachments_.size(); ++id) attachment_of_[attachments_[id].placement] = id;
    for (uint32_t i = 0; i < movable_.size(); ++i)
      if (movable_[i] != 0) update_mover(i, DAffine(world_from_object_[i]));
    list_flat_instances();
  }
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
                    surfaces_.size() * sizeof(Surface) + movable_.size() * (sizeof(uint8_t) + sizeof(uint32_t)) +
                    world_from_object_.size() * sizeof(Affine) +
                    attachment_of_.size() * (sizeof(uint32_t) + sizeof(uint8_t));
  for (const Surface& surface : surfaces_) vertices += surface.positions.size() * sizeof(Vec3);
  for (const Part& part : parts_) {
    indices += part.triangles.size() * sizeof(Triangle);
    tables += part.source_triangles.size() * sizeof(uint32_t);
  }
  return {{"bvh", device_->embree.bytes()}, {"vertices", vertices}, {"indices", indices}, {"tables", tables}};
}

} // namespace packtrace
