#include "runtime/lod/lod_sharing.h"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kSlotsPerBlock = 512;
constexpr uint32_t kNone = ~0u;
constexpr uint32_t kOfProvider = ~0u; // of blas_of_slot_, until the provider's is known

} // namespace

std::vector<uint64_t> passed_of_blas(const LodGeometry& geometry, std::span<const LodStep> steps, const LodPlan& plan,
                                     const PlannedBlas& blas) {
  std::vector<uint64_t> passed(cut_words(geometry));
  if (blas.kind == BlasKind::kOwn)
    std::copy_n(plan.passed.begin() + static_cast<std::ptrdiff_t>(blas.first_word), passed.size(), passed.begin());
  else
    set_prefix(passed, steps[blas.index].passed);
  return passed;
}

LodSharing::LodSharing(std::span<const LodGeometry> geometries, std::span<const LodInstance> instances,
                       const SharingConfig& config)
    : geometries_(geometries), config_(config) {
  config.validate();
  if (instances.size() >= kMaxLodInstances) throw Error(ErrorKind::kLimitExceeded, "2^27 instances or more");
  first_slot_.assign(geometries.size() + 1, 0);
  for (const LodInstance& instance : instances) {
    if (instance.geometry >= geometries.size()) throw Error(ErrorKind::kInput, "an instance of no geometry");
    ++first_slot_[instance.geometry + 1];
  }
  for (size_t g = 0; g < geometries.size(); ++g) first_slot_[g + 1] += first_slot_[g];
  std::vector<uint32_t> next(first_slot_.begin(), first_slot_.end() - 1);
  slots_.resize(instances.size());
  transforms_.resize(instances.size());
  slot_of_instance_.resize(instances.size());
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t slot = next[instances[i].geometry]++;
    slot_of_instance_[i] = slot;
    slots_[slot].instance = i;
    slots_[slot].geometry = instances[i].geometry;
    set_transform(i, instances[i].world_from_object);
  }
  for (uint32_t g = 0; g < geometries.size(); ++g)
    for (uint32_t first = first_slot_[g]; first < first_slot_[g + 1]; first += kSlotsPerBlock)
      blocks_.push_back({g, first, std::min(first + kSlotsPerBlock, first_slot_[g + 1])});
  steps_.resize(geometries.size());
  tbb::parallel_for(size_t{0}, geometries.size(), [&](size_t g) {
    steps_[g] = config_.scheme == SharingScheme::kSteps ? ratio_steps(geometries_[g], config_.step_ratio)
                                                        : level_steps(geometries_[g]);
  });
  choices_.resize(instances.size());
  blas_of_slot_.resize(instances.size());
  parts_.resize(geometries.size());
}

void LodSharing::set_transform(uint32_t instance, const DAffine& world_from_object) {
  const size_t slot = slot_of_instance_[instance];
  const LodGeometry& geometry = geometries_[slots_[slot].geometry];
  InstanceBall& ball = slots_[slot].ball;
  ball.stretch = largest_stretch(world_from_object);
  ball.center = transform_point(world_from_object, geometry.ball().center);
  ball.extent = InstanceMetric::extent(world_from_object, ball.stretch, geometry.reach());
  transforms_[slot] = world_from_object;
}

InstanceMetric LodSharing::metric(size_t slot, const LodView& view) const {
  LodView own = view;
  own.error_per_distance = choices_[slot].error_per_distance;
  return {own, transforms_[slot], slots_[slot].ball.stretch, geometries_[slots_[slot].geometry].reach()};
}

LodSharing::Choice LodSharing::choose(size_t slot, const LodView& view, bool culled) const {
  const InstanceBall& ball = slots_[slot].ball;
  const LodGeometry& geometry = geometries_[slots_[slot].geometry];
  const double radius = geometry.ball().radius;
  const BallDistance distance = ball_distance(view, ball);
  Choice choice;
  choice.error_per_distance = view.error_per_distance * (culled ? config_.culled_error_scale : 1.0);
  const auto evaluate = [&] {
    choice.allowed = allowed_errors(view.near, choice.error_per_distance, distance, ball.stretch, radius);
    choice.range = lod_range(geometry, choice.allowed, view.near, choice.error_per_distance, distance, ball.stretch);
  };
  evaluate();
  if (culled && config_.culled_coarser_levels > 0 && choice.range.min < geometry.last_level()) {
    // As if it might have the error of the discrete level that many levels up.
    const uint32_t level = std::min(geometry.last_level(), choice.range.min + config_.culled_coarser_levels);
    const double one = allowed_errors(view.near, 1.0, distance, ball.stretch, radius).near;
    choice.error_per_distance =
        std::max(choice.error_per_distance, geometry.levels()[level].error / one * (1.0 + 0x1p-30));
    evaluate();
  }
  return choice;
}

/// Shared or own, and which step, of schemes whose shared BLASes are steps.
void LodSharing::choose_step(size_t slot, const LodView& view, Choice& choice) const {
  const uint32_t number = slots_[slot].geometry;
  const LodGeometry& geometry = geometries_[number];
  const std::span<const LodStep> steps = steps_[number];
  const auto last = static_cast<uint32_t>(steps.size()) - 1;
  if (choice.range.min == geometry.last_level()) {
    choice.step = last;
    return;
  }
  const uint32_t stride = config_.tolerant_levels + 1;
  choice.step = coarsest_step(steps, choice.allowed.near);
  choice.step = choice.step + config_.tolerant_levels >= last
                    ? last
                    : (choice.step + config_.tolerant_levels) / stride * stride; // only every stride-th is built
  if (choice.range.min + config_.shared_levels < geometry.levels().size()) {
    choice.category = InstanceCategory::kOwn;
    return;
  }
  const auto holds_too_much = [&](uint64_t own) {
    return static_cast<double>(steps[choice.step].triangles) > config_.own_cut_ratio * static_cast<double>(own);
  };
  // An own cut has no fewer triangles than what all groups that might pass leave.
  if (!holds_too_much(geometry.triangles_of_prefix(geometry.ranks_up_to(choice.allowed.far)))) return;
  InstanceMetric own = metric(slot, view);
  own.error_per_distance = choice.error_per_distance;
  choice.own_triangles = count_cut_triangles(geometry, own, choice.allowed);
  if (holds_too_much(choice.own_triangles)) choice.category = InstanceCategory::kOwn;
}

void LodSharing::plan(const LodView& view, std::span<const uint8_t> culled, LodPlan& plan) {
  if (!culled.empty() && culled.size() != slots_.size())
    throw Error(ErrorKind::kUsage, "not as many visibility flags as instances");
  plan.blas_of_instance.resize(slots_.size());
  plan.category_of_instance.resize(slots_.size());
  plan.allowed_error_of_instance.resize(slots_.size());
  tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) {
    for (uint32_t slot = blocks_[b].first; slot < blocks_[b].last; ++slot) {
      const uint32_t instance = slots_[slot].instance;
      Choice choice = choose(slot, view, !culled.empty() && culled[instance] != 0);
      if (config_.scheme == SharingScheme::kLevels || config_.scheme == SharingScheme::kSteps) {
        choose_step(slot, view, choice);
      } else if (config_.scheme != SharingScheme::kOff) {
        if (choice.range.min == geometries_[blocks_[b].geometry].last_level())
          choice.step = static_cast<uint32_t>(steps_[blocks_[b].geometry].size()) - 1;
        else
          choice.category = InstanceCategory::kOwn;
      }
      plan.allowed_error_of_instance[instance] = choice.allowed.near;
      choices_[slot] = choice;
      if (config_.measure)
        choices_[slot].own_triangles =
            count_cut_triangles(geometries_[blocks_[b].geometry], metric(slot, view), choice.allowed);
    }
  });
  const bool histograms = config_.scheme == SharingScheme::kOneProvider || config_.measure;
  plan.histograms.assign(histograms ? geometries_.size() : 0, {});
  tbb::parallel_for(size_t{0}, geometries_.size(),
                    [&](size_t g) { plan_geometry(static_cast<uint32_t>(g), view, plan); });
  collect(plan);
}

void LodSharing::plan_geometry(uint32_t geometry, const LodView& view, LodPlan& plan) {
  Part& part = parts_[geometry];
  part.blas.clear();
  part.passed.clear();
  const uint32_t first = first_slot_[geometry], last = first_slot_[geometry + 1];
  if (!plan.histograms.empty()) {
    LevelHistogram& histogram = plan.histograms[geometry];
    for (uint32_t slot = first; slot < last; ++slot) {
      const LodRange& range = choices_[slot].range;
      ++histogram.starts[range.min];
      ++histogram.ends[range.max];
      histogram.provider[range.max] = std::max(histogram.provider[range.max], range.min << 27 | slots_[slot].instance);
    }
  }
  const std::span<const LodStep> steps = steps_[geometry];
  std::vector<uint32_t> users(steps.size()), own;
  for (uint32_t slot = first; slot < last; ++slot) {
    if (choices_[slot].category == InstanceCategory::kOwn)
      own.push_back(slot);
    else
      ++users[choices_[slot].step];
  }
  for (uint32_t step = 0; step < steps.size(); ++step) {
    if (users[step] == 0) continue;
    const BlasKind kind = step + 1 == steps.size() ? BlasKind::kLowest : BlasKind::kStep;
    part.blas.push_back({geometry, kind, step, steps[step].clusters, steps[step].triangles, 0, users[step]});
    users[step] = static_cast<uint32_t>(part.blas.size()) - 1; // from here on: where it is
  }
  std::vector<bool> provided(part.blas.size());
  for (uint32_t slot = first; slot < last; ++slot) {
    Choice& choice = choices_[slot];
    if (choice.category == InstanceCategory::kOwn) continue;
    const uint32_t number = users[choice.step];
    blas_of_slot_[slot] = number;
    if (part.blas[number].kind == BlasKind::kLowest) continue;
    choice.category = provided[number] ? InstanceCategory::kShares : InstanceCategory::kProvider;
    provided[number] = true;
  }
  uint32_t provider = kNone;
  if (config_.scheme == SharingScheme::kOneProvider)
    provider = choose_provider(geometry, plan.histograms[geometry], own);
  add_own_cuts(geometry, view, own);
  if (provider == kNone) return;
  for (uint32_t slot = first; slot < last; ++slot)
    if (blas_of_slot_[slot] == kOfProvider) {
      blas_of_slot_[slot] = blas_of_slot_[provider];
      ++part.blas[blas_of_slot_[provider]].users;
    }
}

/// The published scheme: from the finest level on, the first at which some instance ends lends to all that start there.
/// @param own loses those that share @return the provider's slot, or kNone
uint32_t LodSharing::choose_provider(uint32_t geometry, const LevelHistogram& histogram, std::vector<uint32_t>& own) {
  const auto level_count = static_cast<uint32_t>(geometries_[geometry].levels().size());
  uint32_t level = level_count - std::min(level_count, config_.shared_levels);
  while (level + 1 < level_count && histogram.ends[level] == 0) ++level;
  if (level + 1 >= level_count) return kNone;
  const uint32_t provider = slot_of_instance_[histogram.provider[level] & (kMaxLodInstances - 1)];
  choices_[provider].category = InstanceCategory::kProvider;
  std::erase_if(own, [&](uint32_t slot) {
    if (slot == provider || choices_[slot].range.min + config_.tolerant_levels < level) return false;
    choices_[slot].category = InstanceCategory::kShares;
    blas_of_slot_[slot] = kOfProvider;
    return true;
  });
  return provider;
}

/// @param own slots of the geometry, ascending
void LodSharing::add_own_cuts(uint32_t number, const LodView& view, std::span<const uint32_t> own) {
  if (own.empty()) return;
  const LodGeometry& geometry = geometries_[number];
  const size_t words = cut_words(geometry);
  std::vector<uint64_t> cuts(own.size() * words);
  const auto cut = [&](size_t i) { return std::span(cuts).subspan(i * words, words); };
  tbb::parallel_for(size_t{0}, own.size(), [&](size_t i) {
    cut_of_instance(geometry, metric(own[i], view), choices_[own[i]].allowed, cut(i));
  });
  std::vector<uint32_t> same_as(own.size());
  std::iota(same_as.begin(), same_as.end(), 0u);
  if (config_.merge_own_cuts) {
    for (size_t i = 1; i < own.size(); ++i)
      for (size_t word = 0; word < words; ++word) cut(0)[word] &= cut(i)[word];
    same_as.assign(own.size(), 0);
  } else if (config_.share_equal_cuts && config_.scheme != SharingScheme::kPerInstance) {
    std::vector<uint32_t> order = same_as;
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return std::ranges::lexicographical_compare(cut(a), cut(b)); });
    for (size_t i = 1; i < order.size(); ++i)
      if (std::ranges::equal(cut(order[i - 1]), cut(order[i]))) same_as[order[i]] = same_as[order[i - 1]];
  }
  Part& part = parts_[number];
  for (size_t i = 0; i < own.size(); ++i) {
    if (same_as[i] == i) {
      const CutSize size = size_of_cut(geometry, cut(i));
      blas_of_slot_[own[i]] = static_cast<uint32_t>(part.blas.size());
      part.blas.push_back(
          {number, BlasKind::kOwn, slots_[own[i]].instance, size.clusters, size.triangles, part.passed.size(), 1});
      part.passed.insert(part.passed.end(), cut(i).begin(), cut(i).end());
    } else {
      const uint32_t first = own[same_as[i]];
      blas_of_slot_[own[i]] = blas_of_slot_[first];
      ++part.blas[blas_of_slot_[first]].users;
      choices_[first].category = InstanceCategory::kProvider;
      choices_[own[i]].category = InstanceCategory::kShares;
    }
  }
}

/// Puts the geometries' parts one after the other.
void LodSharing::collect(LodPlan& plan) {
  plan.blas.clear();
  plan.passed.clear();
  plan.builds = plan.built_triangles = plan.built_clusters = plan.traced_triangles = plan.own_triangles = 0;
  std::vector<uint32_t> first_blas(parts_.size());
  for (size_t g = 0; g < parts_.size(); ++g) {
    first_blas[g] = static_cast<uint32_t>(plan.blas.size());
    for (PlannedBlas blas : parts_[g].blas) {
      if (blas.kind == BlasKind::kOwn) blas.first_word += plan.passed.size();
      if (blas.kind != BlasKind::kLowest) {
        ++plan.builds;
        plan.built_triangles += blas.triangles;
        plan.built_clusters += blas.clusters;
      }
      plan.traced_triangles += blas.triangles * blas.users;
      plan.blas.push_back(blas);
    }
    plan.passed.insert(plan.passed.end(), parts_[g].passed.begin(), parts_[g].passed.end());
  }
  std::vector<std::array<uint64_t, 5>> counts(blocks_.size()); // by category, then own triangles
  tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) {
    counts[b] = {};
    for (uint32_t slot = blocks_[b].first; slot < blocks_[b].last; ++slot) {
      const uint32_t instance = slots_[slot].instance;
      plan.blas_of_instance[instance] = first_blas[blocks_[b].geometry] + blas_of_slot_[slot];
      plan.category_of_instance[instance] = choices_[slot].category;
      ++counts[b][static_cast<size_t>(choices_[slot].category)];
      counts[b][4] += config_.measure ? choices_[slot].own_triangles : 0;
    }
  });
  plan.category_counts = {};
  for (const std::array<uint64_t, 5>& of_block : counts) {
    for (size_t i = 0; i < 4; ++i) plan.category_counts[i] += of_block[i];
    plan.own_triangles += of_block[4];
  }
}

} // namespace packtrace
