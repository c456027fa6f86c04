#include "runtime/lod/lod_sharing.h"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kSlotsPerBlock = 512;
constexpr uint32_t kNone = ~0u;
constexpr uint32_t kOfProvider = ~0u; // in blas_of_slot_, until the provider's BLAS is known

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
  geometry_of_instance_.resize(instances.size());
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t slot = next[instances[i].geometry]++;
    slot_of_instance_[i] = slot;
    slots_[slot].instance = i;
    geometry_of_instance_[i] = instances[i].geometry;
    set_transform(i, instances[i].world_from_object);
  }
  for (uint32_t g = 0; g < geometries.size(); ++g)
    for (uint32_t first = first_slot_[g]; first < first_slot_[g + 1]; first += kSlotsPerBlock)
      blocks_.push_back({g, first, std::min(first + kSlotsPerBlock, first_slot_[g + 1])});
  steps_.resize(geometries.size());
  tbb::parallel_for(size_t{0}, geometries.size(),
                    [&](size_t g) { steps_[g] = ratio_steps(geometries_[g], config_.step_ratio); });
  choices_.resize(instances.size());
  blas_of_slot_.resize(instances.size());
  parts_.resize(geometries.size());
}

void LodSharing::set_transform(uint32_t instance, const DAffine& world_from_object) {
  const size_t slot = slot_of_instance_[instance];
  const LodGeometry& geometry = geometries_[geometry_of_instance_[instance]];
  InstanceBall& ball = slots_[slot].ball;
  ball.stretch = largest_stretch(world_from_object);
  ball.center = transform_point(world_from_object, geometry.ball().center);
  ball.extent = InstanceMetric::extent(world_from_object, ball.stretch, geometry.reach());
  transforms_[slot] = world_from_object;
}

LodSharing::Need LodSharing::need(const Frame& frame, const LodGeometry& geometry, size_t slot) const {
  const InstanceBall& ball = slots_[slot].ball;
  const double radius = geometry.ball().radius, near = frame.view.near;
  const BallDistance distance = ball_distance(frame.view, ball);
  const bool culled = !frame.culled.empty() && frame.culled[slots_[slot].instance] != 0;
  Need need;
  need.error_per_distance = frame.view.error_per_distance * (culled ? config_.culled_error_scale : 1.0);
  const auto evaluate = [&] {
    need.allowed = allowed_errors(near, need.error_per_distance, distance, ball.stretch, radius);
    need.range.min = first_level(geometry, need.allowed);
    if (frame.ranges)
      need.range = lod_range(geometry, need.allowed, near, need.error_per_distance, distance, ball.stretch);
  };
  evaluate();
  if (culled && config_.culled_coarser_levels > 0 && need.range.min < geometry.last_level()) {
    // Allows the error of the discrete level that many levels up.
    const uint32_t level = std::min(geometry.last_level(), need.range.min + config_.culled_coarser_levels);
    const double one = allowed_errors(near, 1.0, distance, ball.stretch, radius).near;
    need.error_per_distance = std::max(need.error_per_distance, geometry.levels()[level].error / one * (1.0 + 0x1p-30));
    evaluate();
  }
  return need;
}

InstanceMetric LodSharing::metric(const Frame& frame, const LodGeometry& geometry, size_t slot,
                                  const Need& need) const {
  DetailView view = frame.view;
  view.error_per_distance = need.error_per_distance;
  return {view, transforms_[slot], slots_[slot].ball.stretch, geometry.reach()};
}

/// Chooses between a shared step and an own cut, with kSteps.
/// @param fine_step coarsest step that passes for sure; set to the coarsest step that is fine enough
void LodSharing::choose_step(const Frame& frame, uint32_t number, size_t slot, const Need& need, Choice& choice,
                             uint32_t& fine_step) const {
  const LodGeometry& geometry = geometries_[number];
  const std::span<const LodStep> steps = steps_[number];
  const auto last = static_cast<uint32_t>(steps.size()) - 1;
  choice.step = fine_step;
  // Lower bound of the triangles of its own cut: those that remain if all undecided groups pass.
  choice.own_triangles =
      std::min(steps[choice.step].triangles, geometry.triangles_of_prefix(geometry.ranks_up_to(need.allowed.far)));
  if (choice.own_triangles < steps[choice.step].triangles) {
    const CutCount own = count_cut(geometry, metric(frame, geometry, slot, need), need.allowed);
    choice.own_triangles = own.triangles;
    choice.step = std::max(choice.step, coarsest_step_of_prefix(steps, own.prefix));
  }
  fine_step = choice.step;
  const uint32_t stride = config_.tolerant_levels + 1;
  choice.step += config_.tolerant_levels;
  choice.step = choice.step >= last ? last : choice.step / stride * stride; // only every stride-th step is built
  const auto shared = static_cast<double>(steps[choice.step].triangles);
  if (choice.step < last && (need.range.min + config_.shared_levels < geometry.levels().size() ||
                             shared > config_.own_cut_ratio * static_cast<double>(choice.own_triangles)))
    choice.category = InstanceCategory::kOwn;
}

void LodSharing::choose_slots(const Frame& frame, const Block& block, LodPlan& plan) {
  const LodGeometry& geometry = geometries_[block.geometry];
  const auto last_step = static_cast<uint32_t>(steps_[block.geometry].size()) - 1;
  for (uint32_t slot = block.first; slot < block.last; ++slot) {
    const Need wanted = need(frame, geometry, slot);
    uint32_t& fine_step = plan.step_of_instance[slots_[slot].instance];
    fine_step = coarsest_step(steps_[block.geometry], wanted.allowed.near);
    plan.allowed_error_of_instance[slots_[slot].instance] = wanted.allowed.near;
    Choice choice;
    choice.min_level = static_cast<uint8_t>(wanted.range.min);
    choice.max_level = static_cast<uint8_t>(wanted.range.max);
    if (config_.scheme == SharingScheme::kOff) {
      choice.step = 0;
    } else if (wanted.range.min == geometry.last_level()) {
      choice.step = last_step;
      choice.own_triangles = steps_[block.geometry][last_step].triangles;
    } else if (config_.scheme == SharingScheme::kSteps) {
      choose_step(frame, block.geometry, slot, wanted, choice, fine_step);
    } else {
      choice.category = InstanceCategory::kOwn;
    }
    if (config_.measure)
      choice.own_triangles = count_cut(geometry, metric(frame, geometry, slot, wanted), wanted.allowed).triangles;
    choices_[slot] = choice;
  }
}

void LodSharing::plan(const DetailView& view, std::span<const uint8_t> culled, LodPlan& plan) {
  if (!culled.empty() && culled.size() != slots_.size())
    throw Error(ErrorKind::kUsage, "not as many visibility flags as instances");
  const bool histograms = config_.scheme == SharingScheme::kOneProvider || config_.measure;
  const Frame frame{view, culled, histograms};
  plan.blas_of_instance.resize(slots_.size());
  plan.category_of_instance.resize(slots_.size());
  plan.allowed_error_of_instance.resize(slots_.size());
  plan.step_of_instance.resize(slots_.size());
  tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) { choose_slots(frame, blocks_[b], plan); });
  plan.histograms.assign(histograms ? geometries_.size() : 0, {});
  tbb::parallel_for(size_t{0}, geometries_.size(),
                    [&](size_t g) { plan_geometry(frame, static_cast<uint32_t>(g), plan); });
  collect(plan);
}

void LodSharing::plan_geometry(const Frame& frame, uint32_t geometry, LodPlan& plan) {
  Part& part = parts_[geometry];
  part.blas.clear();
  part.passed.clear();
  part.own.clear();
  part.users.assign(steps_[geometry].size(), 0);
  const uint32_t first = first_slot_[geometry], last = first_slot_[geometry + 1];
  if (first == last) return;
  if (!plan.histograms.empty()) fill_histogram(geometry, plan.histograms[geometry]);
  for (uint32_t slot = first; slot < last; ++slot) {
    if (choices_[slot].category == InstanceCategory::kOwn)
      part.own.push_back(slot);
    else
      ++part.users[choices_[slot].step];
  }
  if (config_.scheme == SharingScheme::kSteps && config_.traced_ratio > 0.0) balance(geometry);
  add_steps(geometry);
  uint32_t provider = kNone;
  if (config_.scheme == SharingScheme::kOneProvider) provider = choose_provider(geometry, plan.histograms[geometry]);
  add_own_cuts(frame, geometry);
  if (provider == kNone) return;
  for (uint32_t slot = first; slot < last; ++slot)
    if (blas_of_slot_[slot] == kOfProvider) {
      blas_of_slot_[slot] = blas_of_slot_[provider];
      ++part.blas[blas_of_slot_[provider]].users;
    }
}

void LodSharing::fill_histogram(uint32_t geometry, LevelHistogram& histogram) const {
  for (uint32_t slot = first_slot_[geometry]; slot < first_slot_[geometry + 1]; ++slot) {
    const Choice& choice = choices_[slot];
    ++histogram.starts[choice.min_level];
    ++histogram.ends[choice.max_level];
    histogram.provider[choice.max_level] =
        std::max(histogram.provider[choice.max_level], uint32_t{choice.min_level} << 27 | slots_[slot].instance);
  }
}

/// Reduces the number of builds within SharingConfig::traced_ratio.
void LodSharing::balance(uint32_t geometry) {
  const std::span<const LodStep> steps = steps_[geometry];
  Part& part = parts_[geometry];
  part.savings.clear();
  uint64_t own = 0, traced = 0;
  for (uint32_t slot = first_slot_[geometry]; slot < first_slot_[geometry + 1]; ++slot) {
    const Choice& choice = choices_[slot];
    const uint64_t shared = steps[choice.step].triangles;
    own += choice.own_triangles;
    traced += choice.category == InstanceCategory::kOwn ? choice.own_triangles : shared;
    if (choice.category != InstanceCategory::kOwn && shared > choice.own_triangles)
      part.savings.push_back({shared - choice.own_triangles, choice.step, slot});
  }
  std::sort(part.savings.begin(), part.savings.end(), [](const OwnCutSaving& a, const OwnCutSaving& b) {
    return a.triangles != b.triangles ? a.triangles > b.triangles : a.slot < b.slot;
  });
  const double limit = config_.traced_ratio * static_cast<double>(own);
  SharingBalance balance = balance_builds(steps, part.users, traced, limit, part.savings);
  for (size_t i = 0; i < balance.own_cuts; ++i) {
    choices_[part.savings[i].slot].category = InstanceCategory::kOwn;
    part.own.push_back(part.savings[i].slot);
  }
  std::sort(part.own.begin(), part.own.end());
  part.users = std::move(balance.users);
  for (uint32_t slot = first_slot_[geometry]; slot < first_slot_[geometry + 1]; ++slot)
    choices_[slot].step = balance.instead[choices_[slot].step];
}

void LodSharing::add_steps(uint32_t geometry) {
  Part& part = parts_[geometry];
  const std::span<const LodStep> steps = steps_[geometry];
  for (uint32_t step = 0; step < steps.size(); ++step) {
    if (part.users[step] == 0) continue;
    const BlasKind kind = step + 1 == steps.size() ? BlasKind::kCoarsest : BlasKind::kStep;
    part.blas.push_back({geometry, kind, step, steps[step].clusters, steps[step].triangles, 0, part.users[step]});
    part.users[step] = static_cast<uint32_t>(part.blas.size()) - 1; // from here on: index in part.blas
  }
  std::vector<bool> provided(part.blas.size());
  for (uint32_t slot = first_slot_[geometry]; slot < first_slot_[geometry + 1]; ++slot) {
    Choice& choice = choices_[slot];
    if (choice.category == InstanceCategory::kOwn) continue;
    const uint32_t number = part.users[choice.step];
    blas_of_slot_[slot] = number;
    if (part.blas[number].kind == BlasKind::kCoarsest) continue;
    choice.category = provided[number] ? InstanceCategory::kShares : InstanceCategory::kProvider;
    provided[number] = true;
  }
}

/// The published scheme: the first level, from the finest, at which the range of some instance ends. That instance
/// provides for all whose range starts there or coarser.
/// @return the provider's slot, or kNone
uint32_t LodSharing::choose_provider(uint32_t geometry, const LevelHistogram& histogram) {
  const auto level_count = static_cast<uint32_t>(geometries_[geometry].levels().size());
  uint32_t level = level_count - std::min(level_count, config_.shared_levels);
  while (level + 1 < level_count && histogram.ends[level] == 0) ++level;
  if (level + 1 >= level_count) return kNone;
  const uint32_t provider = slot_of_instance_[histogram.provider[level] & (kMaxLodInstances - 1)];
  choices_[provider].category = InstanceCategory::kProvider;
  std::erase_if(parts_[geometry].own, [&](uint32_t slot) {
    if (slot == provider || choices_[slot].min_level + config_.tolerant_levels < level) return false;
    choices_[slot].category = InstanceCategory::kShares;
    blas_of_slot_[slot] = kOfProvider;
    return true;
  });
  return provider;
}

void LodSharing::add_own_cuts(const Frame& frame, uint32_t number) {
  Part& part = parts_[number];
  const std::vector<uint32_t>& own = part.own; // slots, ascending
  if (own.empty()) return;
  const LodGeometry& geometry = geometries_[number];
  const size_t words = cut_words(geometry);
  std::vector<uint64_t> cuts(own.size() * words);
  const auto cut = [&](size_t i) { return std::span(cuts).subspan(i * words, words); };
  tbb::parallel_for(size_t{0}, own.size(), [&](size_t i) {
    const Need wanted = need(frame, geometry, own[i]);
    cut_of_instance(geometry, metric(frame, geometry, own[i], wanted), wanted.allowed, cut(i));
  });
  std::vector<uint32_t> same_as(own.size());
  std::iota(same_as.begin(), same_as.end(), 0u);
  if (config_.merge_own_cuts) {
    for (size_t i = 1; i < own.size(); ++i)
      for (size_t word = 0; word < words; ++word) cut(0)[word] &= cut(i)[word];
    same_as.assign(own.size(), 0);
  } else if (config_.share_equal_cuts) {
    std::vector<uint32_t> order = same_as;
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return std::ranges::lexicographical_compare(cut(a), cut(b)); });
    for (size_t i = 1; i < order.size(); ++i)
      if (std::ranges::equal(cut(order[i - 1]), cut(order[i]))) same_as[order[i]] = same_as[order[i - 1]];
  }
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

/// Concatenates the parts of all geometries.
void LodSharing::collect(LodPlan& plan) {
  plan.blas.clear();
  plan.passed.clear();
  plan.builds = plan.built_triangles = plan.built_clusters = plan.traced_triangles = 0;
  std::vector<uint32_t> first_blas(parts_.size());
  for (size_t g = 0; g < parts_.size(); ++g) {
    first_blas[g] = static_cast<uint32_t>(plan.blas.size());
    for (PlannedBlas blas : parts_[g].blas) {
      if (blas.kind == BlasKind::kOwn) blas.first_word += plan.passed.size();
      if (blas.kind != BlasKind::kCoarsest) {
        ++plan.builds;
        plan.built_triangles += blas.triangles;
        plan.built_clusters += blas.clusters;
      }
      plan.traced_triangles += blas.triangles * blas.users;
      plan.blas.push_back(blas);
    }
    plan.passed.insert(plan.passed.end(), parts_[g].passed.begin(), parts_[g].passed.end());
  }
  struct BlockCounts {
    std::array<uint64_t, 4> categories{};
    OwnCuts own;
  };
  std::vector<BlockCounts> counts(blocks_.size());
  tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) {
    const uint32_t last_level = geometries_[blocks_[b].geometry].last_level();
    for (uint32_t slot = blocks_[b].first; slot < blocks_[b].last; ++slot) {
      const uint32_t instance = slots_[slot].instance;
      plan.blas_of_instance[instance] = first_blas[blocks_[b].geometry] + blas_of_slot_[slot];
      plan.category_of_instance[instance] = choices_[slot].category;
      ++counts[b].categories[static_cast<size_t>(choices_[slot].category)];
      if (!config_.measure) continue;
      OwnCuts& own = counts[b].own;
      own.traced_triangles += choices_[slot].own_triangles;
      if (choices_[slot].min_level == last_level) continue;
      ++own.builds;
      own.built_triangles += choices_[slot].own_triangles;
    }
  });
  plan.category_counts = {};
  plan.own = {};
  for (const BlockCounts& of_block : counts) {
    for (size_t i = 0; i < 4; ++i) plan.category_counts[i] += of_block.categories[i];
    plan.own.builds += of_block.own.builds;
    plan.own.built_triangles += of_block.own.built_triangles;
    plan.own.traced_triangles += of_block.own.traced_triangles;
  }
}

} // namespace packtrace
