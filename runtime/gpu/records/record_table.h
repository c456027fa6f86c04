#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "runtime/gpu/records/gpu_records.h"

/// The only description of the records that both C++ and GLSL read. static_asserts compare GLSL's layout (std430) with
/// that of the C++ records; gpu_record_generator writes the GLSL.
namespace packtrace::gpu {

struct GlslField {
  std::string_view type, name;
  uint32_t offset;    ///< in the C++ record
  uint32_t count = 1; ///< elements; more than 1: an array
};

struct GlslRecord {
  std::string_view name;
  uint32_t bytes; ///< sizeof the C++ record
  std::span<const GlslField> fields;
};

/// Size and alignment of a scalar; arrays of scalars have the same alignment in std430.
constexpr uint32_t scalar_bytes(std::string_view type) { return type == "double" ? 8 : 4; }

/// Whether the offsets and the size of a record are the same in GLSL and C++.
constexpr bool same_layout(const GlslRecord& record) {
  uint32_t at = 0, alignment = 4;
  for (const GlslField& field : record.fields) {
    const uint32_t bytes = scalar_bytes(field.type);
    alignment = alignment > bytes ? alignment : bytes;
    at = (at + bytes - 1) / bytes * bytes;
    if (at != field.offset) return false;
    at += bytes * field.count;
  }
  return (at + alignment - 1) / alignment * alignment == record.bytes;
}

inline constexpr std::array kPlacementFields = {
    GlslField{"double", "grid_from_unit", offsetof(packed::TracePlacement, grid_from_unit), 12},
    GlslField{"double", "box_lo", offsetof(packed::TracePlacement, box_lo), 3},
    GlslField{"double", "box_hi", offsetof(packed::TracePlacement, box_hi), 3},
    GlslField{"uint", "tree", offsetof(packed::TracePlacement, tree)},
    GlslField{"uint", "classes_aligned", offsetof(packed::TracePlacement, ray_classes)}, // | aligned << 16
};
static_assert(offsetof(packed::TracePlacement, aligned) == offsetof(packed::TracePlacement, ray_classes) + 2);

inline constexpr std::array kRayFields = {
    GlslField{"float", "origin", offsetof(packed::KernelRay, origin), 3},
    GlslField{"float", "tnear", offsetof(packed::KernelRay, tnear)},
    GlslField{"float", "direction", offsetof(packed::KernelRay, direction), 3},
    GlslField{"float", "tfar", offsetof(packed::KernelRay, tfar)},
};

inline constexpr std::array kHitFields = {
    GlslField{"float", "t", offsetof(packed::KernelHit, t)},
    GlslField{"float", "u", offsetof(packed::KernelHit, u)},
    GlslField{"float", "v", offsetof(packed::KernelHit, v)},
    GlslField{"uint", "placement", offsetof(packed::KernelHit, placement)},
    GlslField{"uint", "cluster", offsetof(packed::KernelHit, cluster)},
    GlslField{"uint", "triangle", offsetof(packed::KernelHit, triangle)},
};

inline constexpr std::array kClusterFields = {
    GlslField{"uint", "word", offsetof(ClusterRecord, word)},
    GlslField{"int", "base", offsetof(ClusterRecord, base), 3},
    GlslField{"uint", "position_bit", offsetof(ClusterRecord, position_bit)},
    GlslField{"uint", "shifts", offsetof(ClusterRecord, shifts)},
    GlslField{"uint", "flags", offsetof(ClusterRecord, flags)},
    GlslField{"uint", "mask", offsetof(ClusterRecord, mask)},
};

inline constexpr std::array kTreeFields = {
    GlslField{"uint", "first_node", offsetof(TreeRecord, first_node)},
    GlslField{"float", "max_coordinate", offsetof(TreeRecord, max_coordinate)},
    GlslField{"uint", "flags", offsetof(TreeRecord, flags)},
    GlslField{"uint", "reserved", offsetof(TreeRecord, reserved)},
};

inline constexpr std::array kRangeFields = {
    GlslField{"uint", "first_triangle", offsetof(RangeRecord, first_triangle)},
    GlslField{"uint", "cluster", offsetof(RangeRecord, cluster)},
};

inline constexpr std::array kInstanceFields = {
    GlslField{"uint", "placement", offsetof(InstanceRecord, placement)},
    GlslField{"uint", "first_range", offsetof(InstanceRecord, first_range), 2},
    GlslField{"uint", "range_count", offsetof(InstanceRecord, range_count), 2},
};

inline constexpr std::array kSceneFields = {
    GlslField{"uint", "placement_count", offsetof(SceneRecord, placement_count)},
    GlslField{"uint", "material_word", offsetof(SceneRecord, material_word)},
    GlslField{"float", "top_max_coordinate", offsetof(SceneRecord, top_max_coordinate)},
    GlslField{"float", "top_pad_coordinate", offsetof(SceneRecord, top_pad_coordinate)},
};

inline constexpr std::array kSpanFields = {
    GlslField{"uint", "first", offsetof(SpanRecord, first)},
    GlslField{"uint", "count", offsetof(SpanRecord, count)},
    GlslField{"uint", "ray_class", offsetof(SpanRecord, ray_class)},
    GlslField{"uint", "reserved", offsetof(SpanRecord, reserved)},
};

inline constexpr std::array kCameraFields = {
    GlslField{"double", "eye", offsetof(CameraRecord, eye), 3},
    GlslField{"double", "corner", offsetof(CameraRecord, corner), 3},
    GlslField{"double", "right", offsetof(CameraRecord, right), 3},
    GlslField{"double", "down", offsetof(CameraRecord, down), 3},
    GlslField{"uint", "width", offsetof(CameraRecord, width)},
    GlslField{"uint", "height", offsetof(CameraRecord, height)},
};

inline constexpr std::array kViewFields = {
    GlslField{"double", "linear", offsetof(ViewRecord, linear), 9},
    GlslField{"double", "eye", offsetof(ViewRecord, eye), 3},
    GlslField{"double", "centre", offsetof(ViewRecord, centre), 3},
    GlslField{"double", "scale", offsetof(ViewRecord, scale)},
    GlslField{"double", "near_", offsetof(ViewRecord, near_)},
    GlslField{"uint", "width", offsetof(ViewRecord, width)},
    GlslField{"uint", "height", offsetof(ViewRecord, height)},
    GlslField{"uint", "orthographic", offsetof(ViewRecord, orthographic)},
    GlslField{"uint", "reserved", offsetof(ViewRecord, reserved)},
};

inline constexpr std::array kInstanceSurfaceFields = {
    GlslField{"double", "unit_from_surface", offsetof(InstanceSurface, unit_from_surface), 12},
    GlslField{"float", "world_from_object", offsetof(InstanceSurface, world_from_object), 9},
    GlslField{"float", "reserved", offsetof(InstanceSurface, reserved)},
};

inline constexpr std::array kNormalFields = {
    GlslField{"uint", "place", offsetof(NormalRecord, place)},
    GlslField{"uint", "widths", offsetof(NormalRecord, widths)},
    GlslField{"uint", "anchors", offsetof(NormalRecord, anchors)},
    GlslField{"uint", "instance", offsetof(NormalRecord, instance)},
};

inline constexpr std::array kSurfaceViewFields = {
    GlslField{"double", "inverse_scale", offsetof(SurfaceViewRecord, inverse_scale)},
    GlslField{"double", "depth", offsetof(SurfaceViewRecord, depth), 4},
    GlslField{"double", "depth_scale", offsetof(SurfaceViewRecord, depth_scale)},
    GlslField{"double", "before", offsetof(SurfaceViewRecord, before), 12},
    GlslField{"double", "before_depth_scale", offsetof(SurfaceViewRecord, before_depth_scale)},
    GlslField{"double", "window", offsetof(SurfaceViewRecord, window), 4},
    GlslField{"double", "size", offsetof(SurfaceViewRecord, size), 2},
    GlslField{"double", "offset_px", offsetof(SurfaceViewRecord, offset_px), 2},
    GlslField{"double", "no_motion_px", offsetof(SurfaceViewRecord, no_motion_px)},
    GlslField{"uint", "moved", offsetof(SurfaceViewRecord, moved)},
    GlslField{"uint", "before_orthographic", offsetof(SurfaceViewRecord, before_orthographic)},
};

inline constexpr std::array kPicturePointsFields = {
    GlslField{"double", "centre", offsetof(PicturePointsRecord, centre), 3},
    GlslField{"double", "scale", offsetof(PicturePointsRecord, scale)},
    GlslField{"uint", "first", offsetof(PicturePointsRecord, first)},
    GlslField{"uint", "count", offsetof(PicturePointsRecord, count)},
    GlslField{"uint", "width", offsetof(PicturePointsRecord, width)},
    GlslField{"uint", "height", offsetof(PicturePointsRecord, height)},
    GlslField{"uint", "colour", offsetof(PicturePointsRecord, colour)},
    GlslField{"float", "offset_scale", offsetof(PicturePointsRecord, offset_scale)},
};

inline constexpr std::array kPointFields = {
    GlslField{"float", "origin", offsetof(PointRecord, origin), 3},
    GlslField{"float", "up", offsetof(PointRecord, up), 3},
    GlslField{"float", "normal", offsetof(PointRecord, normal), 3},
    GlslField{"uint", "pixel", offsetof(PointRecord, pixel)},
    GlslField{"uint", "x_px", offsetof(PointRecord, x_px)},
    GlslField{"uint", "y_px", offsetof(PointRecord, y_px)},
};

inline constexpr std::array kOcclusionFields = {
    GlslField{"uint", "first_point", offsetof(OcclusionRecord, first_point)},
    GlslField{"uint", "point_count", offsetof(OcclusionRecord, point_count)},
    GlslField{"uint", "first_sample", offsetof(OcclusionRecord, first_sample)},
    GlslField{"uint", "sample_count", offsetof(OcclusionRecord, sample_count)},
    GlslField{"uint", "per_thread", offsetof(OcclusionRecord, per_thread)},
    GlslField{"uint", "idle_lanes", offsetof(OcclusionRecord, idle_lanes)},
    GlslField{"uint", "order", offsetof(OcclusionRecord, order)},
    GlslField{"uint", "seed", offsetof(OcclusionRecord, seed)},
    GlslField{"float", "tfar", offsetof(OcclusionRecord, tfar)},
    GlslField{"float", "inverse_radius", offsetof(OcclusionRecord, inverse_radius)},
    GlslField{"float", "lambda", offsetof(OcclusionRecord, lambda)},
    GlslField{"float", "darkening", offsetof(OcclusionRecord, darkening)},
    GlslField{"float", "end", offsetof(OcclusionRecord, end)},
    GlslField{"float", "floor_", offsetof(OcclusionRecord, floor)},
    GlslField{"float", "scale", offsetof(OcclusionRecord, scale)},
    GlslField{"float", "parabola", offsetof(OcclusionRecord, parabola)},
};

inline constexpr std::array kOcclusionImageFields = {
    GlslField{"double", "per_sample", offsetof(OcclusionImageRecord, per_sample)},
    GlslField{"double", "radius", offsetof(OcclusionImageRecord, radius)},
    GlslField{"uint", "point_count", offsetof(OcclusionImageRecord, point_count)},
    GlslField{"uint", "sample_count", offsetof(OcclusionImageRecord, sample_count)},
    GlslField{"uint", "pixel_count", offsetof(OcclusionImageRecord, pixel_count)},
    GlslField{"uint", "nearest", offsetof(OcclusionImageRecord, nearest)},
};

inline constexpr std::array kDenoiseFields = {
    GlslField{"uint", "width", offsetof(DenoiseRecord, width)},
    GlslField{"uint", "height", offsetof(DenoiseRecord, height)},
    GlslField{"uint", "flags", offsetof(DenoiseRecord, flags)},
    GlslField{"float", "depth", offsetof(DenoiseRecord, depth)},
    GlslField{"float", "slope", offsetof(DenoiseRecord, slope)},
    GlslField{"float", "longest_still", offsetof(DenoiseRecord, longest_still)},
    GlslField{"float", "longest_moving", offsetof(DenoiseRecord, longest_moving)},
    GlslField{"float", "nearby", offsetof(DenoiseRecord, nearby)},
    GlslField{"float", "longest", offsetof(DenoiseRecord, longest)},
    GlslField{"float", "fast_frames", offsetof(DenoiseRecord, fast_frames)},
    GlslField{"float", "fast_share", offsetof(DenoiseRecord, fast_share)},
    GlslField{"float", "gamma", offsetof(DenoiseRecord, gamma)},
    GlslField{"float", "change_tolerance", offsetof(DenoiseRecord, change_tolerance)},
    GlslField{"float", "response", offsetof(DenoiseRecord, response)},
    GlslField{"float", "guide_depth", offsetof(DenoiseRecord, guide_depth)},
    GlslField{"float", "guide_slope", offsetof(DenoiseRecord, guide_slope)},
    GlslField{"float", "guide_bend", offsetof(DenoiseRecord, guide_bend)},
    GlslField{"uint", "no_distance", offsetof(DenoiseRecord, no_distance)},
    GlslField{"uint", "shift", offsetof(DenoiseRecord, shift)},
    GlslField{"uint", "limit", offsetof(DenoiseRecord, limit)},
    GlslField{"uint", "stretch", offsetof(DenoiseRecord, stretch)},
    GlslField{"float", "noise_tolerance", offsetof(DenoiseRecord, noise_tolerance)},
    GlslField{"float", "prior", offsetof(DenoiseRecord, prior)},
    GlslField{"float", "still_factor", offsetof(DenoiseRecord, still_factor)},
    GlslField{"float", "still_power", offsetof(DenoiseRecord, still_power)},
    GlslField{"float", "moving_base", offsetof(DenoiseRecord, moving_base)},
    GlslField{"float", "moving_gain", offsetof(DenoiseRecord, moving_gain)},
    GlslField{"float", "ratio_prior", offsetof(DenoiseRecord, ratio_prior)},
    GlslField{"float", "per_sample", offsetof(DenoiseRecord, per_sample)},
    GlslField{"float", "young", offsetof(DenoiseRecord, young)},
    GlslField{"float", "distrust", offsetof(DenoiseRecord, distrust)},
    GlslField{"float", "most_spread", offsetof(DenoiseRecord, most_spread)},
};

inline constexpr std::array kRecords = {
    GlslRecord{"PlacementRecord", sizeof(packed::TracePlacement), kPlacementFields},
    GlslRecord{"RayRecord", sizeof(packed::KernelRay), kRayFields},
    GlslRecord{"HitRecord", sizeof(packed::KernelHit), kHitFields},
    GlslRecord{"ClusterRecord", sizeof(ClusterRecord), kClusterFields},
    GlslRecord{"TreeRecord", sizeof(TreeRecord), kTreeFields},
    GlslRecord{"RangeRecord", sizeof(RangeRecord), kRangeFields},
    GlslRecord{"InstanceRecord", sizeof(InstanceRecord), kInstanceFields},
    GlslRecord{"SceneRecord", sizeof(SceneRecord), kSceneFields},
    GlslRecord{"SpanRecord", sizeof(SpanRecord), kSpanFields},
    GlslRecord{"CameraRecord", sizeof(CameraRecord), kCameraFields},
    GlslRecord{"ViewRecord", sizeof(ViewRecord), kViewFields},
    GlslRecord{"InstanceSurface", sizeof(InstanceSurface), kInstanceSurfaceFields},
    GlslRecord{"NormalRecord", sizeof(NormalRecord), kNormalFields},
    GlslRecord{"SurfaceViewRecord", sizeof(SurfaceViewRecord), kSurfaceViewFields},
    GlslRecord{"PicturePointsRecord", sizeof(PicturePointsRecord), kPicturePointsFields},
    GlslRecord{"PointRecord", sizeof(PointRecord), kPointFields},
    GlslRecord{"OcclusionRecord", sizeof(OcclusionRecord), kOcclusionFields},
    GlslRecord{"OcclusionImageRecord", sizeof(OcclusionImageRecord), kOcclusionImageFields},
    GlslRecord{"DenoiseRecord", sizeof(DenoiseRecord), kDenoiseFields},
};

constexpr bool same_layouts() {
  for (const GlslRecord& record : kRecords)
    if (!same_layout(record)) return false;
  return true;
}
static_assert(same_layouts(), "GLSL would lay out a record differently from C++");

// Kernels read nodes as vectors of four words, and the records of the mask buffer as words.
static_assert(sizeof(baked::PackedNode) == 80 && offsetof(baked::PackedNode, exponents) == 12 &&
              offsetof(baked::PackedNode, ray_classes) == 14 && offsetof(baked::PackedNode, first_triangle) == 15 &&
              offsetof(baked::PackedNode, first_child) == 16 && offsetof(baked::PackedNode, cluster) == 20 &&
              offsetof(baked::PackedNode, children) == 24 && offsetof(baked::PackedNode, lo) == 32 &&
              offsetof(baked::PackedNode, hi) == 56);
static_assert(sizeof(TopNodeRecord) == 112 && offsetof(TopNodeRecord, exponents) == 20 &&
              offsetof(TopNodeRecord, lo) == offsetof(baked::PackedNode, lo) &&
              offsetof(TopNodeRecord, hi) == offsetof(baked::PackedNode, hi) && offsetof(TopNodeRecord, child) == 80);
static_assert(sizeof(MaskedCluster) == 8 && sizeof(MaskMaterial) == 8 && sizeof(MaskImage) == 32);

} // namespace packtrace::gpu
