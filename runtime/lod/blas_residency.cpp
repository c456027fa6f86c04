#include "runtime/lod/blas_residency.h"

#include <algorithm>
#include <limits>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

void ResidencyConfig::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw Error(ErrorKind::kUsage, std::string("residency of levels of detail: ") + what);
  };
  require(triangles_per_frame >= 1 && triangles_per_frame <= uint64_t{1} << 63,
          "triangles_per_frame is not in [1..2^63]");
  require(keep_step_frames <= 1'000'000, "keep_step_frames is not in [0..1e6]");
  require(keep_own_frames <= 1'000'000, "keep_own_frames is not in [0..1e6]");
}

BlasResidency::BlasResidency(const LodSharing& sharing, const ResidencyConfig& config)
    : sharing_(sharing), config_(config), previous_(sharing.instance_count(), kNoBlas) {
  config.validate();
  for (uint32_t g = 0; g < sharing.geometries().size(); ++g) {
    first_step_.push_back(step_handles_.size());
    const std::span<const LodStep> steps = sharing.steps(g);
    step_handles_.resize(step_handles_.size() + steps.size(), kNoBlas);
    step_handles_.back() = g;
    const auto last = static_cast<uint32_t>(steps.size()) - 1;
    residents_.push_back(
        {g, BlasKind::kCoarsest, last, steps[last].clusters, steps[last].triangles, steps[last].error, {}, 0, true});
    live_triangles_ += steps[last].triangles;
    ++live_;
  }
}

std::span<const uint64_t> BlasResidency::passed_of(const LodPlan& plan, const PlannedBlas& planned) const {
  return std::span(plan.passed)
      .subspan(static_cast<size_t>(planned.first_word), cut_words(sharing_.geometries()[planned.geometry]));
}

BlasHandle BlasResidency::find(const LodPlan& plan, const PlannedBlas& planned) const {
  if (planned.kind != BlasKind::kOwn) return step_handles_[first_step_[planned.geometry] + planned.index];
  const std::span<const uint64_t> passed = passed_of(plan, planned);
  const auto at = own_handles_.find({planned.geometry, {passed.begin(), passed.end()}});
  return at == own_handles_.end() ? kNoBlas : at->second;
}

BlasHandle BlasResidency::add(const LodPlan& plan, const PlannedBlas& planned) {
  auto handle = static_cast<BlasHandle>(residents_.size());
  if (free_.empty()) {
    residents_.emplace_back();
  } else {
    handle = free_.back();
    free_.pop_back();
  }
  ResidentBlas& resident = residents_[handle];
  resident = {planned.geometry, planned.kind, 0, planned.clusters, planned.triangles, 0.0, {}, number_, true};
  if (planned.kind == BlasKind::kOwn) {
    const std::span<const uint64_t> passed = passed_of(plan, planned);
    resident.passed.assign(passed.begin(), passed.end());
    resident.error = error_of_cut(sharing_.geometries()[planned.geometry], passed);
    own_handles_[{planned.geometry, resident.passed}] = handle;
  } else {
    resident.step = planned.index;
    resident.error = sharing_.steps(planned.geometry)[planned.index].error;
    step_handles_[first_step_[planned.geometry] + planned.index] = handle;
  }
  live_triangles_ += planned.triangles;
  ++live_;
  frame_.built.push_back(handle);
  frame_.built_triangles += planned.triangles;
  return handle;
}

void BlasResidency::drop(BlasHandle handle) {
  ResidentBlas& resident = residents_[handle];
  if (resident.kind == BlasKind::kOwn)
    own_handles_.erase({resident.geometry, resident.passed});
  else
    step_handles_[first_step_[resident.geometry] + resident.step] = kNoBlas;
  live_triangles_ -= resident.triangles;
  --live_;
  resident.live = false;
  resident.passed.clear();
  frame_.dropped.push_back(handle);
}

/// The BLAS that an instance uses while its planned one is missing.
BlasResidency::Substitute BlasResidency::substitute(const LodPlan& plan, uint32_t instance) const {
  const PlannedBlas& planned = plan.blas[plan.blas_of_instance[instance]];
  const double allowed = plan.allowed_error_of_instance[instance];
  const std::span<const LodStep> steps = sharing_.steps(planned.geometry);
  const BlasHandle* handles = &step_handles_[first_step_[planned.geometry]];
  BlasHandle fine = kNoBlas, coarse = kNoBlas; // coarsest that is fine enough, finest that is not
  const uint32_t coarsest = plan.step_of_instance[instance];
  for (uint32_t step = coarsest + 1; step-- > 0 && fine == kNoBlas;) fine = handles[step];
  for (uint32_t step = coarsest + 1; step < steps.size() && coarse == kNoBlas; ++step) coarse = handles[step];
  if (const BlasHandle last = previous_[instance]; last != kNoBlas && residents_[last].live) {
    const ResidentBlas& blas = residents_[last];
    bool enough = blas.error <= std::max(allowed, steps[coarsest].error);
    if (!enough && blas.kind == BlasKind::kOwn && planned.kind == BlasKind::kOwn) {
      const std::span<const uint64_t> passed = passed_of(plan, planned);
      enough = true;
      for (size_t word = 0; word < passed.size(); ++word) enough &= (blas.passed[word] & ~passed[word]) == 0;
    }
    if (enough && (fine == kNoBlas || blas.triangles < residents_[fine].triangles)) fine = last;
    if (!enough && (coarse == kNoBlas || blas.error < residents_[coarse].error)) coarse = last;
  }
  if (fine != kNoBlas) return {fine, 1.0};
  const double ratio = allowed > 0.0 ? residents_[coarse].error / allowed : std::numeric_limits<double>::infinity();
  return {coarse, std::max(ratio, std::nextafter(1.0, 2.0))};
}

void BlasResidency::build_missing(const LodPlan& plan) {
  missing_.clear();
  uint64_t triangles = 0;
  wanted_.resize(plan.blas.size());
  for (uint32_t i = 0; i < plan.blas.size(); ++i) {
    wanted_[i] = find(plan, plan.blas[i]);
    if (wanted_[i] == kNoBlas) {
      missing_.push_back({i, 1.0});
      triangles += plan.blas[i].triangles;
    } else {
      residents_[wanted_[i]].last_used = number_;
    }
  }
  if (triangles > config_.triangles_per_frame) { // over budget: builds with the largest error ratio first
    std::vector<double> ratios(plan.blas.size(), 1.0);
    for (uint32_t i = 0; i < plan.blas_of_instance.size(); ++i)
      if (const uint32_t planned = plan.blas_of_instance[i]; wanted_[planned] == kNoBlas)
        ratios[planned] = std::max(ratios[planned], substitute(plan, i).error_ratio);
    for (Missing& m : missing_) m.ratio = ratios[m.planned];
    std::sort(missing_.begin(), missing_.end(), [&](const Missing& a, const Missing& b) {
      const uint32_t users_a = plan.blas[a.planned].users, users_b = plan.blas[b.planned].users;
      return a.ratio != b.ratio ? a.ratio > b.ratio : users_a != users_b ? users_a > users_b : a.planned < b.planned;
    });
  }
  for (const Missing& m : missing_) {
    const PlannedBlas& planned = plan.blas[m.planned];
    const BlasHandle same = find(plan, planned); // own cuts of two instances may be equal
    const bool fits =
        frame_.built.empty() || (frame_.built_triangles <= config_.triangles_per_frame &&
                                 planned.triangles <= config_.triangles_per_frame - frame_.built_triangles);
    if (same != kNoBlas)
      wanted_[m.planned] = same;
    else if (fits)
      wanted_[m.planned] = add(plan, planned);
    else
      ++frame_.waiting_builds;
  }
}

void BlasResidency::refer(const LodPlan& plan) {
  frame_.blas_of_instance.resize(plan.blas_of_instance.size());
  for (uint32_t i = 0; i < plan.blas_of_instance.size(); ++i) {
    BlasHandle handle = wanted_[plan.blas_of_instance[i]];
    if (handle == kNoBlas) {
      const Substitute other = substitute(plan, i);
      handle = other.handle;
      residents_[handle].last_used = number_;
      if (other.error_ratio > 1.0) {
        ++frame_.coarse_instances;
        frame_.largest_error_ratio = std::max(frame_.largest_error_ratio, other.error_ratio);
      } else {
        ++frame_.waiting_instances;
      }
    }
    frame_.blas_of_instance[i] = handle;
  }
}

void BlasResidency::drop_unused() {
  for (BlasHandle handle = 0; handle < residents_.size(); ++handle) {
    const ResidentBlas& resident = residents_[handle];
    if (!resident.live || resident.kind == BlasKind::kCoarsest) continue;
    const uint32_t keep = resident.kind == BlasKind::kOwn ? config_.keep_own_frames : config_.keep_step_frames;
    if (number_ - resident.last_used > keep) drop(handle);
  }
}

const ResidencyFrame& BlasResidency::update(const LodPlan& plan) {
  if (plan.blas_of_instance.size() != previous_.size())
    throw Error(ErrorKind::kUsage, "residency of levels of detail: a plan for other instances");
  ++number_;
  // handles are not reused in the frame that drops them
  free_.insert(free_.end(), frame_.dropped.begin(), frame_.dropped.end());
  frame_.built.clear();
  frame_.dropped.clear();
  frame_.built_triangles = frame_.waiting_builds = frame_.waiting_instances = frame_.coarse_instances = 0;
  frame_.largest_error_ratio = 1.0;
  build_missing(plan);
  refer(plan);
  drop_unused();
  previous_ = frame_.blas_of_instance;
  return frame_;
}

} // namespace packtrace
