#include "runtime/frame/scene_state.h"

#include <algorithm>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/frame/instance_boxes.h"
#include "runtime/frame/instance_levels.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/packed/scene/mesh_motion.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/voxels/proxy_choice.h"
#include "runtime/voxels/proxy_error.h"
#include "runtime/voxels/proxy_tracer.h"

namespace packtrace {

SceneState::SceneState(const FrameScene& scene, const DetailConfig& detail) : scene_(scene), detail_(detail) {
  if (scene_.motion != nullptr && scene_.motion->moves()) {
    const std::span<const uint32_t> moving = scene_.motion->moving_instances();
    scene_.backend.movers = {{moving.begin(), moving.end()},
                             scene_.motion_bounds.empty() ? scene_.motion->moving_bounds() : scene_.motion_bounds};
    for (const PlacedGeometry& instance : scene_.source->instances()) last_world_.push_back(instance.world_from_object);
    pose_.resize(moving.size()), last_pose_.resize(moving.size());
  }
  if (scene_.deforms && scene_.file != nullptr) meshes_ = std::make_unique<MeshMotion>(*scene_.file);
  if (meshes_ && meshes_->empty()) meshes_.reset();
  if (meshes_ && scene_.backend.backend != Backend::kPacked)
    throw Error(ErrorKind::kUnsupported, "deforming meshes require backend packed");
  if (!scene_.backend.structures && scene_.file != nullptr)
    scene_.backend.structures = make_structure_cache(scene_.backend);
  const auto* packed = dynamic_cast<const PackedSource*>(scene_.source);
  if (scene_.file != nullptr && packed != nullptr) {
    levels_ = std::make_unique<InstanceLevels>(*scene_.file);
    if (levels_->empty()) levels_.reset();
  }
  if (levels_) {
    leveled_source_ = std::make_unique<PackedSource>(*scene_.file);
    scene_.source = packed = leveled_source_.get();
  }
  if (!pose_.empty() || meshes_) boxes_ = std::make_unique<InstanceBoxes>(scene_);
  if (!detail_.error_px) return;
  if (scene_.file == nullptr || packed == nullptr)
    throw Error(ErrorKind::kUsage, "levels of detail require a baked file");
  planner_ = std::make_unique<DetailPlanner>(*scene_.file, *packed, detail_);
}

SceneState::~SceneState() = default;

void SceneState::reset() {
  started_ = false;
  if (levels_) levels_->reset();
  if (boxes_) boxes_->reset();
}

bool SceneState::follow_motion(const SceneMotion& motion) {
  const Movers& movers = scene_.backend.movers;
  if (scene_.motion == nullptr || !std::ranges::equal(movers.instances, motion.moving_instances())) return false;
  Bounds all = movers.world;
  all.extend(motion.moving_bounds());
  if (all.lo != movers.world.lo || all.hi != movers.world.hi) return false;
  scene_.motion = &motion;
  return true;
}

std::vector<uint8_t> SceneState::save() const { return levels_ ? levels_->levels() : std::vector<uint8_t>(); }

bool SceneState::restore(double time_s, std::span<const uint8_t> saved, FrameReport& report) {
  reset();
  pose_instances(time_s, report);
  if (levels_ ? !levels_->set_levels(saved) : !saved.empty()) return false;
  apply_levels(report);
  deform_meshes(time_s, report);
  follow_boxes();
  started_ = true;
  return true;
}

bool SceneState::advance(DVec3 eye, double time_s, FrameReport& report) {
  const bool posed = pose_instances(time_s, report);
  if (levels_) levels_->choose(eye);
  const bool changed = apply_levels(report), deformed = deform_meshes(time_s, report);
  follow_boxes();
  started_ = true;
  return posed || changed || deformed;
}

void SceneState::follow_boxes() {
  if (!boxes_) return;
  const std::span<const uint32_t> moving =
      pose_.empty() ? std::span<const uint32_t>() : scene_.motion->moving_instances();
  boxes_->follow(*scene_.source, moving, pose_, meshes_ ? static_cast<const PackedTracer*>(level_0_.get()) : nullptr);
}

std::span<const MovedBox> SceneState::moved_boxes() const {
  return boxes_ ? boxes_->moved() : std::span<const MovedBox>();
}

const SceneSource& SceneState::traced_source() const {
  return level_tracer_ ? static_cast<const SceneSource&>(planner_->source()) : *scene_.source;
}

const SceneSource& SceneState::camera_source() const {
  return detail_.camera_uses_levels() ? static_cast<const SceneSource&>(planner_->source()) : *scene_.source;
}

std::vector<const RayTracer*> SceneState::tracers() const {
  std::vector<const RayTracer*> all;
  if (!detail_.camera_uses_levels()) all.push_back(level_0_.get());
  if (level_tracer_) all.push_back(level_tracer_.get());
  if (proxy_tracer_) all.push_back(proxy_tracer_.get());
  return all;
}

const PackedTracer* SceneState::deforming_tracer() const {
  return meshes_ ? static_cast<const PackedTracer*>(tracers().front()) : nullptr;
}

/// Moves the instances to their places at a time. Returns whether one moved since the last call.
bool SceneState::pose_instances(double time_s, FrameReport& report) {
  if (pose_.empty()) return false;
  const Stopwatch updating;
  const std::span<const uint32_t> moving = scene_.motion->moving_instances();
  std::swap(pose_, last_pose_);
  scene_.motion->pose(time_s, pose_);
  if (started_)
    for (size_t i = 0; i < moving.size(); ++i) last_world_[moving[i]] = last_pose_[i];
  const bool moved = pose_ != last_pose_;
  if (moved || !started_) {
    for (size_t i = 0; planner_ && i < moving.size(); ++i) planner_->move_instance(moving[i], pose_[i]);
    for (size_t i = 0; levels_ && i < moving.size(); ++i) levels_->move_instance(moving[i], pose_[i]);
    for (RayTracer* tracer : {level_0_.get(), level_tracer_.get()})
      if (tracer != nullptr) tracer->place_instances(moving, pose_);
  }
  report.times.update_s += updating.seconds();
  return moved;
}

/// Lets instances show their current levels by distance. Returns whether some changed.
bool SceneState::apply_levels(FrameReport& report) {
  if (!levels_ || levels_->changes().empty()) return false;
  const Stopwatch updating;
  for (const InstanceLevels::Change& change : levels_->changes()) {
    leveled_source_->set_geometry(change.instance, change.geometry);
    if (planner_) planner_->set_geometry(change.instance, change.geometry);
  }
  report.level_changes = static_cast<uint32_t>(levels_->changes().size());
  if (auto* packed = dynamic_cast<PackedTracer*>(level_0_.get())) {
    packed->replace_instances(scene_.backend.movers);
    if (!pose_.empty()) packed->place_instances(scene_.motion->moving_instances(), pose_);
  } else {
    level_0_.reset(); // made again with the new levels
  }
  report.times.update_s += updating.seconds();
  return true;
}

/// Moves the vertices of deforming meshes to a time. Returns whether some moved.
bool SceneState::deform_meshes(double time_s, FrameReport& report) {
  if (!meshes_) return false;
  build_level_0(report);
  const Stopwatch updating;
  const std::span<const uint8_t> used = levels_ ? levels_->used() : std::span<const uint8_t>();
  const MeshMotion::Update update = meshes_->set_time(time_s, true, static_cast<PackedTracer&>(*level_0_), used);
  if (level_tracer_ && update.triangles > 0) static_cast<PackedTracer&>(*level_tracer_).follow();
  report.rebuilt_trees = update.rebuilt_trees;
  report.times.update_s += updating.seconds();
  return update.moved;
}

/// Moves the instances of a new tracer to their current places.
std::unique_ptr<RayTracer> SceneState::posed(std::unique_ptr<RayTracer> tracer) const {
  if (!pose_.empty()) tracer->place_instances(scene_.motion->moving_instances(), pose_);
  return tracer;
}

void SceneState::build_level_0(FrameReport& report) {
  if (level_0_) return;
  const Stopwatch building;
  if (meshes_)
    level_0_ = std::make_unique<PackedTracer>(*scene_.file, *scene_.source, meshes_->geometries(), DeformConfig{},
                                              chosen_isa(), scene_.backend.movers);
  else
    level_0_ = make_tracer(*scene_.source, scene_.file, scene_.backend);
  level_0_ = posed(std::move(level_0_));
  report.times.build_s += building.seconds();
}

void SceneState::choose_proxies(const PrimaryCamera& view, const GBuffer& seen, double pixels, double most_error,
                                const AoConfig& ao, FrameReport& report) {
  if (scene_.file == nullptr) throw Error(ErrorKind::kUnsupported, "--proxy-beyond requires a .ptk file with proxies");
  if (!pose_.empty() || meshes_ || levels_)
    throw Error(ErrorKind::kUnsupported, "--proxy-beyond does not work with things that move or change by distance");
  build_level_0(report);
  const Stopwatch building;
  if (!proxy_choice_) proxy_choice_ = std::make_unique<ProxyChoice>(*scene_.file);
  std::vector<uint32_t> proxied = proxy_choice_->small_instances(*scene_.source, view, pixels);
  if (!proxy_choice_->pays(proxied, *scene_.source, seen)) proxied.clear();
  if (proxied != proxied_) {
    proxied_ = std::move(proxied);
    proxy_tracer_.reset(); // frees its memory first
    proxy_error_.reset();
    if (!proxied_.empty()) {
      proxy_tracer_ = std::make_unique<ProxyTracer>(*level_0_, *scene_.file, *scene_.source, proxied_, scene_.backend);
      proxy_error_ = packtrace::proxy_error(*scene_.source, *level_0_, *proxy_tracer_, seen, ao);
      if (!(*proxy_error_ <= most_error)) proxy_tracer_.reset();
    }
  }
  report.times.build_s += building.seconds();
}

void SceneState::choose_detail(const PrimaryCamera& view, const GBuffer* seen, FrameReport& report) {
  report.rebuilt = planner_->plan(view, seen);
  report.times.plan_s += planner_->plan_s() + planner_->source_s();
  if (!report.rebuilt) return;
  const Stopwatch building;
  level_tracer_.reset(); // frees the memory of the old trees first
  if (meshes_)
    level_tracer_ =
        std::make_unique<PackedTracer>(*scene_.file, planner_->source(), static_cast<const PackedTracer&>(*level_0_),
                                       chosen_isa(), scene_.backend.movers);
  else
    level_tracer_ = make_tracer(planner_->source(), *scene_.file, scene_.backend);
  level_tracer_ = posed(std::move(level_tracer_));
  report.times.build_s += building.seconds();
}

} // namespace packtrace
