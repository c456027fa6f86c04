#pragma once

#include <cstdint>

namespace packtrace {

/// How BLASes are shared between instances.
enum class SharingScheme : uint8_t {
  kOff,         ///< no LOD: all instances of a geometry share level 0
  kOneProvider, ///< one instance per geometry shares its cut with all that need no finer detail; others have own cuts
  kSteps,       ///< view-independent shared BLASes, whose triangles decrease by a constant ratio
};

/// Parameters of BLAS sharing. Values outside the stated range, or NaN, are rejected, not clamped. With the defaults,
/// no instance gets less detail than its own cut anywhere.
struct SharingConfig {
  SharingScheme scheme = SharingScheme::kSteps;

  /// kSteps: ratio of the triangles of consecutive steps. [1.05..16]
  double step_ratio = 1.15;

  /// kSteps: limits the triangles that all instances of a geometry trace, relative to those of their own cuts.
  /// Within the limit, balance_builds() looks for few builds: instances with the largest savings get own cuts, and
  /// users of steps that are not built take the next finer one. 0 disables this. [0, 1..infinity]
  double traced_ratio = 1.25;

  /// kSteps: an instance gets its own cut if its step has more than this many times the own cut's triangles.
  /// [1..infinity]
  double own_cut_ratio = 4.0;

  /// Number of levels that may be shared, counted from the coarsest; instances that need finer levels get own cuts.
  /// [0..32]
  uint32_t shared_levels = 32;

  /// Number of levels (kOneProvider) or steps (kSteps) by which shared BLASes may be coarser than an instance's own
  /// cut. Values above 0 save builds, but instances may lack detail. [0..32]
  uint32_t tolerant_levels = 0;

  /// Number of levels by which instances without primary visibility are coarser. [0..32]
  uint32_t culled_coarser_levels = 0;

  /// Factor on the allowed error of instances without primary visibility. [1..1e6]
  double culled_error_scale = 1.0;

  /// Instances of a geometry with equal own cuts share one BLAS.
  bool share_equal_cuts = true;

  /// Merges all own cuts of a geometry into one: a group passes in it if it passes in all of them. Leaves at most one
  /// view-dependent BLAS per geometry, with more triangles.
  bool merge_own_cuts = false;

  /// Counts the triangles of every instance's own cut, for reports; otherwise LodPlan::own is 0.
  bool measure = false;

  /// Throws Error(kUsage) that names the field if a value is out of range.
  void validate() const;
};

} // namespace packtrace
