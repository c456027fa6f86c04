#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_cut.h"
#include "runtime/lod/sharing_balance.h"
#include "runtime/lod/sharing_config.h"

namespace packtrace {

/// An instance of a geometry.
struct LodInstance {
  uint32_t geometry = 0;
  DAffine world_from_object{1.0};
};

inline constexpr uint32_t kMaxLodInstances = 1u << 27;

enum class BlasKind : uint8_t {
  kCoarsest, ///< the coarsest cut; every geometry has it from the start
  kStep,     ///< a view-independent step of the geometry
  kOwn,      ///< a cut for this view
};

/// A BLAS that a plan requires.
struct PlannedBlas {
  uint32_t geometry = 0;
  BlasKind kind = BlasKind::kCoarsest;
  uint32_t index = 0; ///< index in LodSharing::steps(); for kOwn, the first instance that uses it
  uint32_t clusters = 0;
  uint64_t triangles = 0;
  uint64_t first_word = 0; ///< kOwn: index in LodPlan::passed of its cut_words() words
  uint32_t users = 0;      ///< number of instances
};

/// How an instance got its BLAS.
enum class InstanceCategory : uint8_t {
  kCoarsest, ///< the coarsest cut is fine enough
  kProvider, ///< first to use a BLAS that others may share
  kShares,   ///< uses another instance's BLAS
  kOwn,      ///< has its own cut
};

/// Histogram of the level ranges of one geometry's instances.
struct LevelHistogram {
  std::array<uint32_t, baked::kMaxLodLevels> starts{}; ///< per level: instances with this LodRange::min
  std::array<uint32_t, baked::kMaxLodLevels> ends{};   ///< per level: instances with this LodRange::max
  /// Per level: the maximum of min << 27 | instance over the instances with this LodRange::max, so the one with the
  /// largest min; ties are resolved the same way in every frame. 0 if there are none.
  std::array<uint32_t, baked::kMaxLodLevels> provider{};
};

/// What a view would need if every instance had its own cut and only the coarsest cuts were shared.
struct OwnCuts {
  uint64_t builds = 0; ///< number of instances for which the coarsest cut is not fine enough
  uint64_t built_triangles = 0;
  uint64_t traced_triangles = 0; ///< sum over all instances
};

/// The BLASes needed for a view, and the BLAS of each instance.
struct LodPlan {
  /// sorted by geometry; within one, steps from fine to coarse, then own cuts by instance
  std::vector<PlannedBlas> blas;
  std::vector<uint64_t> passed; ///< bits of all own cuts
  std::vector<uint32_t> blas_of_instance;
  std::vector<InstanceCategory> category_of_instance;
  std::vector<double> allowed_error_of_instance; ///< all groups up to this error pass; object units
  std::vector<uint32_t> step_of_instance;        ///< the coarsest step that is fine enough, used or not
  std::vector<LevelHistogram> histograms;        ///< per geometry; only with kOneProvider or SharingConfig::measure
  std::array<uint64_t, 4> category_counts{};     ///< per InstanceCategory
  uint64_t builds = 0;                           ///< number of BLASes other than kCoarsest
  uint64_t built_triangles = 0, built_clusters = 0;
  uint64_t traced_triangles = 0; ///< sum over instances, of the BLAS each uses
  OwnCuts own;                   ///< only with SharingConfig::measure
};

/// The groups that pass in a planned BLAS, as cut_words() words.
std::vector<uint64_t> passed_of_blas(const LodGeometry& geometry, std::span<const LodStep> steps, const LodPlan& plan,
                                     const PlannedBlas& blas);

/// Chooses the detail of many instances per frame. The plan depends on neither the number of threads nor earlier
/// frames.
class LodSharing {
public:
  /// @param geometries must outlive this object
  /// Throws Error(kUsage) for an invalid config, Error(kInput) for an instance without geometry or with a transform
  /// that is not finite, and Error(kLimitExceeded) for kMaxLodInstances or more.
  LodSharing(std::span<const LodGeometry> geometries, std::span<const LodInstance> instances,
             const SharingConfig& config);

  size_t instance_count() const { return slots_.size(); }
  const SharingConfig& config() const { return config_; }
  std::span<const LodGeometry> geometries() const { return geometries_; }
  /// The ratio_steps() of a geometry. Schemes other than kSteps use only the first and the last.
  std::span<const LodStep> steps(uint32_t geometry) const { return steps_[geometry]; }

  /// Throws as the constructor does. The instance number must be in range.
  void set_transform(uint32_t instance, const DAffine& world_from_object);

  /// Plans one frame.
  /// @param culled one byte per instance, nonzero if it has no primary visibility; or empty
  /// @param plan overwritten; its memory is reused
  /// Throws Error(kUsage) if `culled` has the wrong size.
  void plan(const DetailView& view, std::span<const uint8_t> culled, LodPlan& plan);
  LodPlan plan(const DetailView& view, std::span<const uint8_t> culled = {}) {
    LodPlan result;
    this->plan(view, culled, result);
    return result;
  }

private:
  struct Slot {
    uint32_t instance = 0;
    InstanceBall ball;
  };
  /// The detail that one instance needs in a view.
  struct Need {
    double error_per_distance = 0.0;
    AllowedErrors allowed;
    LodRange range;
  };
  struct Choice {
    uint64_t own_triangles = 0; ///< of its own cut, or a sufficient lower bound
    uint32_t step = 0;
    uint8_t min_level = 0, max_level = 0;
    InstanceCategory category = InstanceCategory::kCoarsest;
  };
  struct Block {
    uint32_t geometry, first, last; ///< range of slots
  };
  /// One geometry's part of the plan.
  struct Part {
    std::vector<PlannedBlas> blas;
    std::vector<uint64_t> passed;
    std::vector<uint32_t> users; ///< per step
    std::vector<uint32_t> own;   ///< slots
    std::vector<OwnCutSaving> savings;
  };
  struct Frame {
    DetailView view;
    std::span<const uint8_t> culled;
    bool ranges; ///< whether LodRange::max is needed
  };

  Need need(const Frame& frame, const LodGeometry& geometry, size_t slot) const;
  InstanceMetric metric(const Frame& frame, const LodGeometry& geometry, size_t slot, const Need& need) const;
  void choose_slots(const Frame& frame, const Block& block, LodPlan& plan);
  void choose_step(const Frame& frame, uint32_t geometry, size_t slot, const Need& need, Choice& choice,
                   uint32_t& fine_step) const;
  void plan_geometry(const Frame& frame, uint32_t geometry, LodPlan& plan);
  void fill_histogram(uint32_t geometry, LevelHistogram& histogram) const;
  void balance(uint32_t geometry);
  void add_steps(uint32_t geometry);
  uint32_t choose_provider(uint32_t geometry, const LevelHistogram& histogram);
  void add_own_cuts(const Frame& frame, uint32_t geometry);
  void collect(LodPlan& plan);

  std::span<const LodGeometry> geometries_;
  SharingConfig config_;
  std::vector<std::vector<LodStep>> steps_;
  std::vector<Slot> slots_; ///< instances sorted by geometry
  std::vector<DAffine> transforms_;
  std::vector<uint32_t> slot_of_instance_, geometry_of_instance_;
  std::vector<uint32_t> first_slot_; ///< per geometry, plus an end marker
  std::vector<Block> blocks_;
  // Of the current plan.
  std::vector<Choice> choices_;
  std::vector<uint32_t> blas_of_slot_; ///< index in its geometry's part
  std::vector<Part> parts_;
};

} // namespace packtrace
