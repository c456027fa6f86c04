#include "runtime/frame/detail.h"

#include <algorithm>
#include <utility>

#include "runtime/camera/lod_view.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

/// Whether both plans build the same BLASes and use them for the same instances.
bool same_blas(const LodPlan& a, const LodPlan& b) {
  const auto same = [](const PlannedBlas& x, const PlannedBlas& y) {
    return x.geometry == y.geometry && x.kind == y.kind && x.first_word == y.first_word &&
           (x.kind != BlasKind::kStep || x.index == y.index);
  };
  return a.blas_of_instance == b.blas_of_instance && a.passed == b.passed && std::ranges::equal(a.blas, b.blas, same);
}

} // namespace

DetailPlanner::DetailPlanner(const BakedFile& file, const PackedSource& source, const DetailConfig& config)
    : file_(file), packed_(source), config_(config) {
  const Stopwatch loading;
  geometries_ = lod_geometries(file);
  instances_ = lod_instances(source);
  sharing_ = std::make_unique<LodSharing>(geometries_, instances_, config.sharing);
  load_s_ = loading.seconds();
}

bool DetailPlanner::plan(const PrimaryCamera& view, const GBuffer* seen) {
  const DetailView from = detail_view(view, file_.world_bounds(), *config_.error_px);
  const std::vector<uint8_t> culled =
      config_.cull_invisible ? not_in_image(*seen, instances_.size()) : outside_view(view, geometries_, instances_);
  culled_ = static_cast<size_t>(std::ranges::count(culled, 1));
  const Stopwatch planning;
  if (regrouped_) sharing_ = std::make_unique<LodSharing>(geometries_, instances_, config_.sharing);
  regrouped_ = false;
  sharing_->plan(from, culled, next_);
  plan_s_ = planning.seconds();
  std::swap(plan_, next_);
  source_s_ = 0.0;
  if (source_ && same_blas(plan_, next_)) return false;
  const Stopwatch listing;
  source_ = std::make_unique<LodSource>(file_, packed_, *sharing_, plan_);
  source_s_ = listing.seconds();
  return true;
}

void DetailPlanner::set_geometry(uint32_t instance, uint32_t geometry) {
  instances_[instance].geometry = geometry;
  regrouped_ = true;
}

void DetailPlanner::move_instance(uint32_t instance, const Affine& world_from_object) {
  instances_[instance].world_from_object = DAffine(world_from_object);
  sharing_->set_transform(instance, instances_[instance].world_from_object);
}

} // namespace packtrace
