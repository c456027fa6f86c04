#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/lod_cut.h"
#include "runtime/lod/sharing_balance.h"
#include "runtime/lod/sharing_config.h"

namespace packtrace {

/// One placement of a geometry.
struct LodInstance {
  uint32_t geometry = 0;
  DAffine world_from_object{1.0};
};

inline constexpr uint32_t kMaxLodInstances = 1u << 27;

enum class BlasKind : uint8_t {
  kLowest, ///< the coarsest cut: every geometry has it from the start
  kStep,   ///< a step of the geometry, whatever the view
  kOwn,    ///< a cut for this view
};

/// One bottom-level structure that a plan wants.
struct PlannedBlas {
  uint32_t geometry = 0;
  BlasKind kind = BlasKind::kLowest;
  uint32_t index = 0; ///< of LodSharing::steps(); kOwn: the first instance that uses it
  uint32_t clusters = 0;
  uint64_t triangles = 0;
  uint64_t first_word = 0; ///< kOwn: of LodPlan::passed, cut_words() of them
  uint32_t users = 0;      ///< instances
};

/// How an instance came to its BLAS.
enum class InstanceCategory : uint8_t {
  kLowest,   ///< its coarsest cut will do
  kProvider, ///< the first to use a BLAS that others may share
  kShares,   ///< uses another's
  kOwn,      ///< has a cut for itself
};

/// How many instances of one geometry can start and end at each level.
struct LevelHistogram {
  std::array<uint32_t, baked::kMaxLodLevels> starts{}; ///< by LodRange::min
  std::array<uint32_t, baked::kMaxLodLevels> ends{};   ///< by LodRange::max
  /// Of those that end there: the largest of min << 27 | instance, so the one nearest to that level, and of several the
  /// same one each time. 0 if none.
  std::array<uint32_t, baked::kMaxLodLevels> provider{};
};

/// Which BLASes there should be for a view, and who uses which.
struct LodPlan {
  std::vector<PlannedBlas> blas; ///< by geometry; of one: steps from fine to coarse, then own cuts by instance
  std::vector<uint64_t> passed;  ///< of own cuts
  std::vector<uint32_t> blas_of_instance;
  std::vector<InstanceCategory> category_of_instance;
  std::vector<double> allowed_error_of_instance; ///< all groups up to this error pass; object units
  std::vector<uint32_t> step_of_instance;        ///< the coarsest one that has detail enough, used or not
  std::vector<LevelHistogram> histograms;        ///< by geometry; with kOneProvider or SharingConfig::measure only
  std::array<uint64_t, 4> category_counts{};     ///< by InstanceCategory
  uint64_t builds = 0;                           ///< BLASes that are not kLowest
  uint64_t built_triangles = 0, built_clusters = 0;
  uint64_t traced_triangles = 0; ///< over instances, of the BLAS each uses
  uint64_t own_triangles = 0;    ///< over instances, of the cut each would have alone; with SharingConfig::measure only
};

/// The groups that pass in a planned BLAS.
std::vector<uint64_t> passed_of_blas(const LodGeometry& geometry, std::span<const LodStep> steps, const LodPlan& plan,
                                     const PlannedBlas& blas);

/// Chooses the detail of many instances, frame by frame. Same plan for any number of threads, and whatever came before.
class LodSharing {
public:
  /// @param geometries must outlive it
  /// Throws Error(kUsage) for a bad config, Error(kInput) for an instance of no geometry or with a transform that is
  /// not finite, Error(kLimitExceeded) for kMaxLodInstances or more.
  LodSharing(std::span<const LodGeometry> geometries, std::span<const LodInstance> instances,
             const SharingConfig& config);

  size_t instance_count() const { return slots_.size(); }
  const SharingConfig& config() const { return config_; }
  std::span<const LodGeometry> geometries() const { return geometries_; }
  uint32_t geometry_of_instance(uint32_t instance) const { return geometry_of_instance_[instance]; }
  /// Of a geometry, fine to coarse: of its levels, or with kSteps of ratios.
  std::span<const LodStep> steps(uint32_t geometry) const { return steps_[geometry]; }

  /// Throws as the constructor. The number of the instance must be in range.
  void set_transform(uint32_t instance, const DAffine& world_from_object);

  /// @param culled a byte an instance, not 0 for those without primary visibility; or empty
  /// @param plan is overwritten; its memory is used again
  /// Throws Error(kUsage) if `culled` has another size.
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
  /// What one instance may have in a view.
  struct Need {
    double error_per_distance = 0.0;
    AllowedErrors allowed;
    LodRange range;
  };
  struct Choice {
    uint64_t own_triangles = 0; ///< of its own cut, or fewer where that does not matter
    uint32_t step = 0;
    uint8_t min_level = 0, max_level = 0;
    InstanceCategory category = InstanceCategory::kLowest;
  };
  struct Block {
    uint32_t geometry, first, last; ///< slots
  };
  /// What one geometry adds to the plan.
  struct Part {
    std::vector<PlannedBlas> blas;
    std::vector<uint64_t> passed;
    std::vector<uint32_t> users; ///< by step
    std::vector<uint32_t> own;   ///< slots
    std::vector<OwnCutSaving> savings;
  };
  struct Frame {
    DetailView view;
    std::span<const uint8_t> culled;
    bool ranges; ///< ends of ranges are asked for
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
  std::vector<Slot> slots_; ///< instances by geometry
  std::vector<DAffine> transforms_;
  std::vector<uint32_t> slot_of_instance_, geometry_of_instance_;
  std::vector<uint32_t> first_slot_; ///< of each geometry, and the end
  std::vector<Block> blocks_;
  // Of the plan being made.
  std::vector<Choice> choices_;
  std::vector<uint32_t> blas_of_slot_; ///< within its geometry's part
  std::vector<Part> parts_;
};

} // namespace packtrace
