#pragma once

#include <cstdint>

namespace packtrace {

/// Who gets which BLAS.
enum class SharingScheme : uint8_t {
  kOff,         ///< no choice of detail: all instances of a geometry share level 0
  kPerInstance, ///< each instance has its own cut; only the coarsest is shared. What the others are measured against
  kOneProvider, ///< one instance of a geometry lends its cut to all that are no finer anywhere; the others have their
                ///< own
  kLevels,      ///< shared BLASes that do not depend on the view, one for each (geometry, level) in use
  kSteps,       ///< the same with steps of a constant ratio of triangles instead of levels
};

/// Every knob of the choice of detail. Values outside the stated range (NaN included) are rejected, never clamped. With
/// the defaults no instance is given less detail than its own cut has, anywhere.
struct SharingConfig {
  SharingScheme scheme = SharingScheme::kSteps;

  /// kSteps: triangles of one step by those of the next. [1.05..16]
  double step_ratio = 1.15;

  /// kLevels, kSteps: the instances of a geometry together trace at most this many times the triangles of their own
  /// cuts. Within that as few BLASes are built as a greedy search finds: instances that save most by it get cuts of
  /// their own, and steps that cost least to do without are not built: their users take the next finer one.
  /// [1..infinity]
  double traced_ratio = 1.25;

  /// kLevels, kSteps: an instance whose step has more than this many times the triangles of its own cut gets its own
  /// cut in any case. [1..infinity]
  double own_cut_ratio = 4.0;

  /// How many levels, counted from the coarsest, may be shared; instances that need finer ones have their own cuts.
  /// [0..32]
  uint32_t shared_levels = 32;

  /// By how many levels (kSteps: steps) what is shared may be coarser than an instance's own cut. Above 0, instances
  /// may be under-detailed, and fewer BLASes are built. [0..32]
  uint32_t tolerant_levels = 0;

  /// Instances without primary visibility: by how many levels they are coarser. [0..32]
  uint32_t culled_coarser_levels = 0;

  /// Instances without primary visibility: how many times the error they may have. [1..1e6]
  double culled_error_scale = 1.0;

  /// Instances of a geometry whose own cuts are the same share one BLAS. Not for kPerInstance.
  bool share_equal_cuts = true;

  /// All own cuts of a geometry become one: what passes for all of them. At most one BLAS a geometry that depends on
  /// the view, and more triangles.
  bool merge_own_cuts = false;

  /// Count the triangles of every instance's own cut, for reports. Else LodPlan::own_triangles stays 0.
  bool measure = false;

  /// Throws Error(kUsage), naming the field, if one is out of range.
  void validate() const;
};

} // namespace packtrace
