#pragma once

#include <cstdint>

#include "runtime/trace/packed/kernels/kernel_types.h"

/// Records that the host writes and kernels read. record_table.h describes them, and those of kernel_types.h, once for
/// both languages.
namespace packtrace::gpu {

// ClusterRecord::flags
inline constexpr uint32_t kMaskedCluster = packed::kMasked;
/// Vertices are read as floats from the buffer of exact vertices, because packed::kNeedsWideDecode is set.
inline constexpr uint32_t kExactVertices = packed::kNeedsWideDecode;

/// A cluster: packed::TraceCluster with an offset for the pointer.
struct ClusterRecord {
  uint32_t word; ///< of the payload, where the cluster's bits begin
  /// As TraceCluster::base. With kExactVertices base[0] is the number of the cluster's first exact vertex.
  int32_t base[3];
  uint32_t position_bit; ///< | width of x << 16 | width of y << 24
  uint32_t shifts;       ///< width of z | up << 8 | down << 16 | triangle count << 24
  uint32_t flags;        ///< strip count | TraceCluster::flags << 8
  uint32_t mask;         ///< with kMaskedCluster: word of the mask buffer with the cluster's MaskedCluster
};

// TreeRecord::flags
inline constexpr uint32_t kGraded = 1u << 0;             ///< TraceTree::graded
inline constexpr uint32_t kInexactDifferences = 1u << 1; ///< coordinates exceed kExactDifferences
inline constexpr uint32_t kFineTree = 1u << 2;           ///< coordinates exceed kFineGrid

struct TreeRecord {
  uint32_t first_node;
  float max_coordinate; ///< TraceTree::max_coordinate
  uint32_t flags;
  uint32_t reserved;
};

/// A node of the tree over placements, with the words of a baked::PackedNode where kernels read both alike.
struct TopNodeRecord {
  float origin[3];
  uint32_t ray_classes; ///< all << 16
  uint32_t reserved;
  uint32_t exponents; ///< of the units of the boxes: x | y << 8 | z << 16, each plus 127
  uint32_t kind;      ///< baked::kInnerChild
  uint32_t reserved2;
  uint8_t lo[3][baked::kNodeWidth], hi[3][baked::kNodeWidth]; ///< as PackedNode's, in units from the origin
  uint32_t child[baked::kNodeWidth];                          ///< as packed::TopNode's
};

/// A cluster in the table that translates the triangles of an acceleration structure.
struct RangeRecord {
  uint32_t first_triangle; ///< of the geometry of the structure
  uint32_t cluster;
};

/// A placed acceleration structure, by its number in the top level.
struct InstanceRecord {
  uint32_t placement;
  uint32_t first_range[2], range_count[2]; ///< by geometry of the structure
};

/// Constants of a scene for all rays.
struct SceneRecord {
  uint32_t placement_count; ///< the record of the tree over placements follows the last one
  uint32_t material_word;   ///< word of the mask buffer with the materials of placement 0; see MaskedCluster
  float top_max_coordinate, top_pad_coordinate;
};

/// A span of rays to trace.
struct SpanRecord {
  uint32_t first, count; ///< rays
  uint32_t ray_class;
  uint32_t reserved;
};

/// A perspective camera: the direction through the centre of pixel (x, y) is corner + x right + y down, in unit space.
struct CameraRecord {
  double eye[3], corner[3], right[3], down[3];
  uint32_t width, height;
};

/// A camera whose rays have the bits of PrimaryCamera::linear_ray() and approach_scene().
struct ViewRecord {
  double linear[9];               ///< of world_from_camera, by column
  double eye[3];                  ///< its translation
  double centre[3], scale, near_; ///< of the unit space: UnitSpace::kNear
  uint32_t width, height;
  uint32_t orthographic; ///< 1, or 0: perspective
  uint32_t reserved;
};

/// The transforms of an instance's surfaces: Placement.
struct InstanceSurface {
  double unit_from_surface[12]; ///< by column
  float world_from_object[9];   ///< its linear part, by column
  float reserved;
};
inline constexpr uint32_t kNoInstance = ~0u; ///< in place of an instance's number

/// Offset and packing of the normals of a cluster: NormalPacking, and a palette.
struct NormalRecord {
  uint32_t place;    ///< first bit | encoding << 20 | chart << 24 | kHasNormals
  uint32_t widths;   ///< of x | y << 5 | chart << 10 | palette index << 13 | number of palette entries << 17
  uint32_t anchors;  ///< of x | y << 16
  uint32_t instance; ///< in the tree of the world, else kNoInstance
};
inline constexpr uint32_t kHasNormals = 1u << 31;

/// Cameras of a picture, besides its ViewRecord, for making its surfaces.
struct SurfaceViewRecord {
  double inverse_scale;                    ///< of the unit space
  double depth[4], depth_scale;            ///< third row of camera_from_world, and world units per camera unit
  double before[12], before_depth_scale;   ///< camera_from_world of the previous camera, by column
  double window[4], size[2], offset_px[2]; ///< of the previous camera: left, top, width, height on its film; pixels
  double no_motion_px;                     ///< kNoMotionPx
  uint32_t moved;                          ///< 1: the camera moved
  uint32_t before_orthographic;            ///< 1, or 0: perspective
};

/// First words of the planes of a G-buffer, in units of the number of pixels; named as GBuffer's arrays.
inline constexpr uint32_t kViewZPlane = 0, kNormalPlane = 1, kInstancePlane = 4, kMotionPlane = 5, kPreviousZPlane = 7,
                          kPositionPlane = 8, kGeometricPlane = 11, kOffsetPlane = 14, kPlaneWords = 15;

/// Points that are made of a picture's planes.
struct PicturePointsRecord {
  double centre[3], scale; ///< of the unit space
  uint32_t first, count;   ///< threads
  uint32_t width, height;
  uint32_t colour; ///< SamplePlan::colour, or 2: all pixels
  float offset_scale;
};

/// A surface point from which occlusion rays start, in unit space.
struct PointRecord {
  float origin[3]; ///< lifted off the surface
  float up[3];     ///< geometric normal, unit length
  float normal[3]; ///< shading normal, unit length
  uint32_t pixel;  ///< kNoPoint: nothing to trace
  uint32_t x_px, y_px;
};
inline constexpr uint32_t kNoPoint = ~0u;

/// A range of surface points and a range of the samples of each.
struct OcclusionRecord {
  uint32_t first_point, point_count;
  uint32_t first_sample, sample_count; ///< numbers in the pixels' sequences
  uint32_t per_thread;                 ///< samples
  uint32_t idle_lanes;                 ///< idle lanes from which on a subgroup starts new rays
  uint32_t order;                      ///< OcclusionOrder
  uint32_t seed;                       ///< of the sampler
  float tfar;
  // Nearest hits: VisibilityCurve, and radii per length of unit space.
  float inverse_radius, lambda, darkening, end, floor, scale, parabola;
};

/// Points whose sums become pixels.
struct OcclusionImageRecord {
  double per_sample; ///< 1 / sample_count
  double radius;     ///< of occlusion, in the units of hit distances
  uint32_t point_count, sample_count, pixel_count;
  uint32_t nearest; ///< 1: sums of nearest hits; 0: counts of any hits
};

/// Choice and order of the sample points of a pixel.
inline constexpr uint32_t kNetOrder = 0;       ///< SamplerKind::kSpaceTimeNet, by number
inline constexpr uint32_t kDirectionOrder = 1; ///< 256 strata along a curve: neighbouring pixels shoot in one direction
inline constexpr uint32_t kRandomOrder = 2;    ///< the same strata, in an order of the pixel's own

// DenoiseRecord::flags
inline constexpr uint32_t kHasHistory = 1u << 0;    ///< there is a frame before
inline constexpr uint32_t kFollowMotion = 1u << 1;  ///< HistorySource::kMotion
inline constexpr uint32_t kKeepGuides = 1u << 2;    ///< HistorySource::kUnchanged, with a frame before
inline constexpr uint32_t kHasPreviousZ = 1u << 3;  ///< GBuffer::previous_z
inline constexpr uint32_t kHasLimits = 1u << 4;     ///< AoFrame::max_history
inline constexpr uint32_t kTestInstances = 1u << 5; ///< FluxConfig::reprojection_instance_test
inline constexpr uint32_t kStratified = 1u << 6;    ///< AoFrame::stratified
inline constexpr uint32_t kLastPass = 1u << 7;      ///< of the filter: writes the result

/// Terms of the denoiser's passes. Names are those of LocateTerms, HistoryLengths, CorrectTerms, GuideTerms, PatchTerms
/// and VarianceTerms.
struct DenoiseRecord {
  uint32_t width, height, flags;
  float depth, slope, longest_still, longest_moving, nearby;
  float longest, fast_frames;
  float fast_share, gamma, change_tolerance, response;
  float guide_depth, guide_slope, guide_bend;
  uint32_t no_distance, shift, limit, stretch;
  float noise_tolerance, prior, still_factor, still_power, moving_base, moving_gain, ratio_prior;
  float per_sample, young, distrust, most_spread;
};
static_assert(sizeof(DenoiseRecord) <= 128, "push constants of more bytes need not exist");

/// In the mask buffer: a cluster whose triangles need a mask lookup. Its texture coordinates follow, two floats a
/// vertex, if has_uvs is not 0.
struct MaskedCluster {
  uint32_t has_uvs;
  /// Material slot in the placement's materials; for clusters of the world tree, their number from material 0 on.
  uint32_t slot;
};

/// In the mask buffer: words of the masks that a material has for all rays and for occlusion rays; 0: none.
struct MaskMaterial {
  uint32_t all_rays, shadows;
};

/// In the mask buffer: an AlphaMask. Its words follow.
struct MaskImage {
  uint32_t width, height, wrap, reserved;
  float scale[2], offset[2];
};

} // namespace packtrace::gpu
