// The part of SceneBuilder that deals with worlds, blocks, objects and instances.
#include <algorithm>
#include <array>
#include <bit>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/builder/scene_builder.h"
#include "pbrt_import/scene/flattening.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {

void SceneBuilder::begin_world(const Directive& directive) {
  if (phase_ == Phase::kWorld)
    return reporter_.error(directive.place, "WorldBegin inside the world block; it is ignored");
  phase_ = Phase::kWorld;
  ++statistics_.worlds;
  options_after_world_.reset();
  if (!reading()) return;
  set_scene_time();
  state_.reset_transform();
  define_coordinate_system("world", state_.transform());
}

void SceneBuilder::end_world(const Place& place) {
  const std::vector<Block> open = state_.blocks();
  for (const Block& block : open)
    reporter_.warning(block.place, std::string(begin_keyword(block.kind)) + " without its " +
                                       std::string(end_keyword(block.kind)) + " before the world ends at " +
                                       to_string(reporter_.locate(place)));
  while (!state_.blocks().empty()) state_.close_block();
  std::fill(std::begin(open_blocks_), std::end(open_blocks_), 0u);
  ignored_blocks_ = nested_objects_ = 0;
  current_object_ = kNone;
  phase_ = Phase::kOptions;
  ++world_;
}

void SceneBuilder::open(BlockKind kind, const Directive& directive) {
  if (state_.blocks().size() >= options_.max_nesting) {
    ++ignored_blocks_;
    return reporter_.error(directive.place, "blocks are nested more than " + std::to_string(options_.max_nesting) +
                                                " deep; deeper ones do not keep the state apart");
  }
  state_.open_block(kind, directive.place);
  ++open_blocks_[static_cast<size_t>(kind)];
}

void SceneBuilder::close(BlockKind kind, const Directive& directive) {
  if (ignored_blocks_ > 0) {
    --ignored_blocks_;
    return;
  }
  const auto top = [&]() -> const Block& { return state_.blocks().back(); };
  if (open_blocks_[static_cast<size_t>(kind)] == 0) {
    std::string message = std::string(end_keyword(kind)) + " without " + std::string(begin_keyword(kind));
    if (!state_.blocks().empty())
      message += "; the innermost open block is the " + std::string(begin_keyword(top().kind)) + " at " +
                 to_string(reporter_.locate(top().place));
    return reporter_.error(directive.place, std::move(message));
  }
  while (true) {
    const Block& block = top();
    const BlockKind closed = block.kind;
    if (closed != kind)
      reporter_.error(directive.place, std::string(end_keyword(kind)) + " closes the " +
                                           std::string(begin_keyword(closed)) + " at " +
                                           to_string(reporter_.locate(block.place)) + ", which has no " +
                                           std::string(end_keyword(closed)) + " before it");
    state_.close_block();
    --open_blocks_[static_cast<size_t>(closed)];
    if (closed == BlockKind::kObject) {
      if (nested_objects_ > 0)
        --nested_objects_;
      else
        current_object_ = kNone;
    }
    if (closed == kind) return;
  }
}

void SceneBuilder::begin_object(const Directive& directive) {
  const uint64_t ignored_before = ignored_blocks_;
  open(BlockKind::kObject, directive);
  if (ignored_blocks_ != ignored_before) return;
  if (current_object_ != kNone) {
    ++nested_objects_;
    return reporter_.error(directive.place, "ObjectBegin " + in_quotes(directive.names[0]) + " inside object " +
                                                in_quotes(scene_.objects[current_object_].name) +
                                                "; its shapes belong to the outer object");
  }
  current_object_ = static_cast<uint32_t>(scene_.objects.size());
  const uint32_t name = object_names_.intern(directive.names[0]);
  if (name < objects_by_name_.size()) {
    reporter_.warning(directive.place, "object " + in_quotes(directive.names[0]) +
                                           " is defined again; later instances show the new one, unlike the one at " +
                                           to_string(reporter_.locate(object_places_[objects_by_name_[name]])));
    objects_by_name_[name] = current_object_;
  } else {
    objects_by_name_.push_back(current_object_);
  }
  scene_.objects.push_back({directive.names[0], {}});
  object_places_.push_back(directive.place);
}

void SceneBuilder::add_instance(const Directive& directive) {
  const std::string& name = directive.names[0];
  if (current_object_ != kNone)
    return reporter_.error(directive.place, "ObjectInstance " + in_quotes(name) + " inside object " +
                                                in_quotes(scene_.objects[current_object_].name) +
                                                "; objects cannot hold instances");
  if (last_object_ == kNone || last_name_ != name) {
    last_name_ = name;
    last_object_ = object_names_.find(name).value_or(kNone);
  }
  if (last_object_ == kNone)
    return reporter_.error(directive.place,
                           "no object " + in_quotes(name) + "; the instance is skipped" +
                               did_you_mean(object_names_.closest(name, [](uint32_t) { return true; })));
  const Placement placement = place(directive, "instance");
  const Affine world_from_object(placement.map);
  if (!check_instance(directive, world_from_object)) return;
  reserve_one_more(scene_.instances);
  if (placement.animation != kNotAnimated)
    scene_.animated_instances.push_back({static_cast<uint32_t>(scene_.instances.size()), placement.animation});
  if (directive.motion.track != kNoTrack)
    tracked_.add_instance(static_cast<uint32_t>(scene_.instances.size()), directive.motion);
  scene_.instances.push_back({objects_by_name_[last_object_], world_from_object});
  instance_residuals_.push_back(placement.map, world_from_object);
}

/// Reports a transform that cannot place an instance, or flattens it.
/// @return false if the instance must be skipped
bool SceneBuilder::check_instance(const Directive& directive, const Affine& world_from_object) {
  if (is_finite(world_from_object[3])) {
    // Long rows of instances only differ in their translations, so bits are compared first.
    using Bits = std::array<uint32_t, 9>;
    const glm::mat3 linear(world_from_object);
    if (std::bit_cast<Bits>(linear) == std::bit_cast<Bits>(sound_linear_)) return true;
    if (is_sound(glm::dmat3(linear))) {
      sound_linear_ = linear;
      return true;
    }
  }
  if (!is_invertible(DAffine(world_from_object))) {
    reporter_.error(directive.place, "the instance's transform has no inverse (a scale of 0?); it is skipped");
    return false;
  }
  if (flattens(DAffine(world_from_object)))
    reporter_.warning(directive.place,
                      "the instance's transform flattens it (a scale near 0?): its extents differ by a "
                      "factor of more than a million; voxels and distance fields leave it out");
  return true;
}

uint32_t SceneBuilder::add_track(MotionTrack track) {
  count_kept(track.keys.capacity() * sizeof(MotionKey));
  return tracked_.add_track(std::move(track));
}

SceneBuilder::Placement SceneBuilder::place(const Directive& directive, std::string_view thing) {
  if (!state_.transform_known())
    reporter_.warning(directive.place,
                      "this " + std::string(thing) + " may stand in a wrong place: a transform before it is ignored");
  if (!state_.animated()) return {state_.start_transform(), kNotAnimated};
  const TransformPair pair = state_.transform();
  const std::optional<AnimatedTransform> keys = animate(pair.start, pair.end, transform_times_);
  if (!keys) {
    if (is_invertible(pair.start)) // otherwise the caller reports it
      reporter_.error(directive.place, "animated " + std::string(thing) +
                                           ": its transform at EndTime has no inverse; it stands as at its start");
    return {pair.start, kNotAnimated};
  }
  reporter_.note(directive.place, "animated " + std::string(thing) + ": it stands as at time " + to_text(scene_.time));
  std::vector<AnimatedTransform>& all = scene_.animations;
  const bool as_before = !all.empty() && all.back().start.map == pair.start && all.back().end.map == pair.end;
  if (!as_before) all.push_back(*keys);
  return {interpolate(*keys, scene_.time), static_cast<uint32_t>(all.size() - 1)};
}

/// Sets the time at which animations are evaluated, once all options are known.
void SceneBuilder::set_scene_time() {
  scene_.time = options_.time.value_or(cameras_.shutter_open());
  cameras_.settle(scene_.time, transform_times_, scene_.animations, reporter_);
}

void SceneBuilder::check_worlds(const Place& end) {
  const uint64_t worlds = statistics_.worlds;
  if (wanted_world() > std::max<uint64_t>(worlds, 1))
    throw FileError(ErrorKind::kInput, reporter_.locate({end.file, 0, 0}),
                    "there is no world " + std::to_string(wanted_world()) + ": the file has " + std::to_string(worlds));
  if (worlds == 0) return set_scene_time();
  if (worlds > 1)
    reporter_.report(options_.world ? Severity::kNote : Severity::kWarning, end,
                     "the file has " + std::to_string(worlds) + " worlds; only world " +
                         std::to_string(wanted_world()) + " is read");
  if (phase_ != Phase::kOptions) return;
  phase_ = Phase::kDone;
  if (options_after_world_)
    reporter_.warning(*options_after_world_,
                      "what follows the last WorldEnd has no effect: options belong before their WorldBegin");
}

void SceneBuilder::report_media() {
  for (const auto& [name, place] : media_uses_)
    if (!media_.contains(name)) reporter_.error(place, "MediumInterface: no medium " + in_quotes(name));
  for (const auto& [name, place] : media_)
    if (!media_uses_.contains(name)) reporter_.note(place, "medium " + in_quotes(name) + " is never used");
}

} // namespace packtrace
