#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "runtime/lod/lod_sharing.h"

namespace packtrace {

/// Parameters of BlasResidency. Values out of range are rejected, not clamped.
struct ResidencyConfig {
  /// Limit of the triangles of BLASes built per frame; at least one BLAS is built. [1..2^63]
  uint64_t triangles_per_frame = 4'000'000;

  /// Number of frames that an unused step is kept, as the same step may be needed again. [0..1e6]
  uint32_t keep_step_frames = 120;

  /// The same for own cuts, which are rarely needed again. [0..1e6]
  uint32_t keep_own_frames = 2;

  /// Throws Error(kUsage) that names the field.
  void validate() const;
};

/// Number of a live BLAS; may be reused after it is dropped.
using BlasHandle = uint32_t;
inline constexpr BlasHandle kNoBlas = ~0u;

/// A BLAS that exists.
struct ResidentBlas {
  uint32_t geometry = 0;
  BlasKind kind = BlasKind::kCoarsest;
  uint32_t step = 0; ///< unused for kOwn
  uint32_t clusters = 0;
  uint64_t triangles = 0;
  double error = 0.0;           ///< largest error of the groups that pass; object units
  std::vector<uint64_t> passed; ///< for kOwn
  uint64_t last_used = 0;       ///< frame number
  bool live = false;
};

/// What happens in one frame. Builds come before their use; dropped BLASes are unused from this frame on.
struct ResidencyFrame {
  std::vector<BlasHandle> built, dropped;
  std::vector<BlasHandle> blas_of_instance;
  uint64_t built_triangles = 0;
  uint64_t waiting_builds = 0;    ///< planned builds that are deferred to later frames
  uint64_t waiting_instances = 0; ///< instances that use another BLAS than planned, fine enough everywhere
  uint64_t coarse_instances = 0;  ///< instances that use a BLAS that is too coarse somewhere
  /// Largest ratio, over the coarse instances, of the error of the BLAS used and the error allowed for the whole
  /// instance: an upper bound of the factor by which the pixel error is exceeded. 1 if there are none.
  double largest_error_ratio = 1.0;
};

/// Turns plans into builds and drops within a budget per frame.
///
/// While an instance's BLAS is missing, the instance uses the smallest BLAS that is fine enough, among the existing
/// steps and the one that it used last, or else the one with the smallest error; the frame reports this. The coarsest
/// cut of each geometry always exists, so there are no holes. BLASes with the largest error ratio are built first. Once
/// no builds wait, every instance uses the planned BLAS, whatever the camera's path.
class BlasResidency {
public:
  /// Handles 0, 1, ... are the coarsest cuts of the geometries.
  /// @param sharing must outlive this object; its geometries, steps and number of instances are used
  BlasResidency(const LodSharing& sharing, const ResidencyConfig& config);

  /// Advances to the next frame. The result is valid until the next call.
  const ResidencyFrame& update(const LodPlan& plan);

  const ResidentBlas& blas(BlasHandle handle) const { return residents_[handle]; }
  size_t live_count() const { return live_; }
  uint64_t live_triangles() const { return live_triangles_; }

private:
  struct Missing {
    uint32_t planned;
    double ratio;
  };
  struct Substitute {
    BlasHandle handle = kNoBlas;
    double error_ratio = 1.0; ///< 1 if fine enough
  };

  BlasHandle find(const LodPlan& plan, const PlannedBlas& planned) const;
  BlasHandle add(const LodPlan& plan, const PlannedBlas& planned);
  void drop(BlasHandle handle);
  Substitute substitute(const LodPlan& plan, uint32_t instance) const;
  void build_missing(const LodPlan& plan);
  void refer(const LodPlan& plan);
  void drop_unused();
  std::span<const uint64_t> passed_of(const LodPlan& plan, const PlannedBlas& planned) const;

  const LodSharing& sharing_;
  ResidencyConfig config_;
  std::vector<ResidentBlas> residents_;
  std::vector<BlasHandle> free_;
  std::vector<BlasHandle> step_handles_; ///< per geometry and step
  std::vector<size_t> first_step_;       ///< per geometry
  std::map<std::pair<uint32_t, std::vector<uint64_t>>, BlasHandle> own_handles_;
  std::vector<BlasHandle> wanted_;   ///< per planned BLAS
  std::vector<BlasHandle> previous_; ///< per instance
  std::vector<Missing> missing_;
  ResidencyFrame frame_;
  uint64_t number_ = 0, live_triangles_ = 0;
  size_t live_ = 0;
};

} // namespace packtrace
