#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "runtime/lod/lod_sharing.h"

namespace packtrace {

/// Knobs of BlasResidency. Values out of range are rejected, never clamped.
struct ResidencyConfig {
  /// Triangles of the BLASes built in one frame; one is built in any case. [1..2^63]
  uint64_t triangles_per_frame = 4'000'000;

  /// Frames for which a step that nobody uses is kept: it is the same again when somebody comes back. [0..1e6]
  uint32_t keep_step_frames = 120;

  /// The same for own cuts, which seldom come back. [0..1e6]
  uint32_t keep_own_frames = 2;

  /// Throws Error(kUsage), naming the field.
  void validate() const;
};

/// Number of a BLAS while there is one; later ones may get it again.
using BlasHandle = uint32_t;
inline constexpr BlasHandle kNoBlas = ~0u;

/// A BLAS that there is.
struct ResidentBlas {
  uint32_t geometry = 0;
  BlasKind kind = BlasKind::kLowest;
  uint32_t step = 0; ///< unless kOwn
  uint32_t clusters = 0;
  uint64_t triangles = 0;
  double error = 0.0;           ///< the largest of the groups that pass; object units
  std::vector<uint64_t> passed; ///< kOwn
  uint64_t last_used = 0;       ///< frame
  bool live = false;
};

/// What one frame does. Builds come before what uses them; what is dropped is used no more from this frame on.
struct ResidencyFrame {
  std::vector<BlasHandle> built, dropped;
  std::vector<BlasHandle> blas_of_instance;
  uint64_t built_triangles = 0;
  uint64_t waiting_builds = 0;    ///< planned, put off to later frames
  uint64_t waiting_instances = 0; ///< use something else than planned, all of it fine enough
  uint64_t coarse_instances = 0;  ///< use something that is, somewhere, coarser than they need
  /// Of the coarse ones, the largest quotient of the error of what is used and of what is allowed for all of the
  /// instance: an upper bound of how many times the pixel error is missed. 1 if there are none.
  double largest_error_ratio = 1.0;
};

/// Follows plans from frame to frame: what is built, kept and dropped within a budget.
///
/// An instance whose BLAS is not there yet uses the one of fewest triangles that is fine enough, of the steps that are
/// there and what it used last; if none is, the one of least error, and the frame says so. The coarsest cut of each
/// geometry is there from the start and stays, so there are no holes. Builds that somebody misses most come first. Once
/// no builds wait, every instance uses what is planned: there is no memory of how the camera came to where it is.
class BlasResidency {
public:
  /// Handles 0, 1, ... are the coarsest cuts of the geometries.
  /// @param sharing must outlive it; its geometries, steps and number of instances count
  BlasResidency(const LodSharing& sharing, const ResidencyConfig& config);

  /// The next frame. The result is good until the one after.
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
    double error_ratio = 1.0; ///< 1: fine enough
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
  std::vector<BlasHandle> step_handles_; ///< by geometry and step
  std::vector<size_t> first_step_;       ///< of each geometry
  std::map<std::pair<uint32_t, std::vector<uint64_t>>, BlasHandle> own_handles_;
  std::vector<BlasHandle> wanted_;   ///< by planned BLAS
  std::vector<BlasHandle> previous_; ///< by instance
  std::vector<Missing> missing_;
  ResidencyFrame frame_;
  uint64_t number_ = 0, live_triangles_ = 0;
  size_t live_ = 0;
};

} // namespace packtrace
