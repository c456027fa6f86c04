#include "pbrt_import/scene_builder.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/textures.h"
#include "pbrt_import/tokenizer.h"

namespace packtrace {
namespace {

using K = DirectiveKind;

bool is_option(K kind) {
  return kind == K::kAccelerator || kind == K::kCamera || kind == K::kFilm || kind == K::kIntegrator ||
         kind == K::kPixelFilter || kind == K::kSampler || kind == K::kTransformTimes;
}

bool is_world_only(K kind) {
  switch (kind) {
  case K::kAttributeBegin:
  case K::kAttributeEnd:
  case K::kTransformBegin:
  case K::kTransformEnd:
  case K::kObjectBegin:
  case K::kObjectEnd:
  case K::kObjectInstance:
  case K::kTexture:
  case K::kMaterial:
  case K::kMakeNamedMaterial:
  case K::kNamedMaterial:
  case K::kLightSource:
  case K::kAreaLightSource:
  case K::kShape:
  case K::kReverseOrientation:
  case K::kWorldEnd:
    return true;
  default:
    return false;
  }
}

} // namespace

SceneBuilder::SceneBuilder(const ImportOptions& options, const FileNames& file_names, Reporter& reporter)
    : options_(options), file_names_(file_names), reporter_(reporter), loader_(options, reporter) {}

bool SceneBuilder::allowed_here(const Directive& directive) {
  if (phase_ != Phase::kOptions && is_option(directive.kind)) {
    reporter_.error(directive.place, std::string(directive.keyword) + " belongs before WorldBegin; it is ignored");
    return false;
  }
  if (phase_ != Phase::kWorld && is_world_only(directive.kind)) {
    reporter_.error(directive.place,
                    std::string(directive.keyword) + " belongs between WorldBegin and WorldEnd; it is ignored");
    return false;
  }
  return true;
}

void SceneBuilder::handle(Directive& directive) {
  ++statistics_.directives;
  if (!allowed_here(directive)) return;
  if (directive.kind == K::kWorldBegin) return begin_world(directive);
  if (directive.kind == K::kWorldEnd) return end_world(directive.place);
  if (phase_ == Phase::kOptions && statistics_.worlds > 0 && !options_behind_world_)
    options_behind_world_ = directive.place;
  if (reading()) carry_out(directive);
}

void SceneBuilder::carry_out(Directive& directive) {
  switch (directive.kind) {
  case K::kAttributeBegin:
    return open(BlockKind::kAttribute, directive);
  case K::kAttributeEnd:
    return close(BlockKind::kAttribute, directive);
  case K::kTransformBegin:
    return open(BlockKind::kTransform, directive);
  case K::kTransformEnd:
    return close(BlockKind::kTransform, directive);
  case K::kObjectBegin:
    return begin_object(directive);
  case K::kObjectEnd:
    return close(BlockKind::kObject, directive);
  case K::kObjectInstance:
    return add_instance(directive);
  case K::kIdentity:
  case K::kTranslate:
  case K::kScale:
  case K::kRotate:
  case K::kLookAt:
  case K::kTransform:
  case K::kConcatTransform:
    return handle_transform(directive);
  case K::kActiveTransform:
    return handle_active_transform(directive);
  case K::kCoordinateSystem:
  case K::kCoordSysTransform:
    return handle_coordinate_system(directive);
  case K::kCamera:
    coordinate_systems_["camera"] = {inverse(state_.transform().start), inverse(state_.transform().end)};
    return cameras_.add_camera(directive, state_.transform(), reporter_);
  case K::kFilm:
    return cameras_.add_film(directive, reporter_);
  case K::kTexture:
    return handle_texture(directive);
  case K::kMaterial:
  case K::kMakeNamedMaterial:
    return handle_material(directive);
  case K::kNamedMaterial:
    return handle_named_material(directive);
  case K::kAreaLightSource:
    return handle_area_light(directive);
  case K::kLightSource:
    ++statistics_.light_sources;
    ++statistics_.ignored["light_sources"];
    return;
  case K::kReverseOrientation:
    state_.attributes.reverse_orientation = !state_.attributes.reverse_orientation;
    return;
  case K::kShape:
    return add_shape(directive);
  case K::kTransformTimes:
    return handle_transform_times(directive);
  case K::kMakeNamedMedium:
  case K::kMediumInterface:
    return handle_medium(directive);
  case K::kAccelerator:
  case K::kIntegrator:
  case K::kPixelFilter:
  case K::kSampler:
    ++statistics_.ignored["render_settings"];
    return;
  case K::kWorldBegin: // handle() has seen to these
  case K::kWorldEnd:
  case K::kInclude: // never leaves the parser
    return;
  }
}

void SceneBuilder::handle_transform(const Directive& directive) {
  const std::array<double, 16>& n = directive.numbers;
  const auto numbers_finite = [&](size_t count) {
    return std::all_of(n.begin(), n.begin() + static_cast<std::ptrdiff_t>(count),
                       [](double v) { return std::isfinite(v); });
  };
  size_t count = 0;
  std::optional<DAffine> map;
  std::string problem;
  switch (directive.kind) {
  case K::kTranslate:
    map = translation({n[0], n[1], n[2]}), count = 3;
    break;
  case K::kScale:
    map = scaling({n[0], n[1], n[2]}), count = 3;
    break;
  case K::kRotate:
    map = rotation(n[0], {n[1], n[2], n[3]}), count = 4;
    problem = "the axis has no direction";
    break;
  case K::kLookAt:
    map = look_at({n[0], n[1], n[2]}, {n[3], n[4], n[5]}, {n[6], n[7], n[8]}), count = 9;
    if (map) map = inverse(*map); // pbrt's current transform is camera_from_world
    problem = "eye and target coincide, or up is parallel to the view";
    break;
  case K::kTransform:
  case K::kConcatTransform:
    map = affine_from_columns(n), count = 16;
    problem = "the matrix is not affine: every fourth number must be 0, the last one 1";
    break;
  default:
    map = DAffine(1.0);
    break;
  }
  if (!numbers_finite(count)) problem = "a number is not finite", map.reset();
  if (map && !is_finite(*map)) problem = "its numbers are out of range", map.reset();
  if (!map) return reporter_.error(directive.place, std::string(directive.keyword) + " is ignored: " + problem);
  if (directive.kind == K::kIdentity || directive.kind == K::kTransform)
    state_.set_transform(*map);
  else
    state_.concatenate(*map);
}

void SceneBuilder::handle_active_transform(const Directive& directive) {
  const std::string& which = directive.names[0];
  const uint8_t bits = which == "All" ? 3 : which == "StartTime" ? 1 : which == "EndTime" ? 2 : 0;
  if (bits == 0)
    return reporter_.error(directive.place,
                           "ActiveTransform takes All, StartTime or EndTime, found " + in_quotes(which));
  state_.set_active(bits);
}

void SceneBuilder::handle_coordinate_system(const Directive& directive) {
  const std::string& name = directive.names[0];
  if (directive.kind == K::kCoordinateSystem) {
    coordinate_systems_[name] = state_.transform();
    return;
  }
  const auto found = coordinate_systems_.find(name);
  if (found == coordinate_systems_.end())
    return reporter_.error(directive.place, "no coordinate system " + in_quotes(name) + "; the transform stays");
  state_.set_transform(found->second);
}

void SceneBuilder::handle_transform_times(const Directive& directive) {
  const TransformTimes times{directive.numbers[0], directive.numbers[1]};
  if (!std::isfinite(times.start) || !std::isfinite(times.end))
    return reporter_.error(directive.place, "TransformTimes is ignored: a number is not finite");
  if (times.end < times.start)
    reporter_.warning(directive.place,
                      "TransformTimes end before they start: things jump from start to end at " + to_text(times.start));
  transform_times_ = times;
}

void SceneBuilder::handle_material(const Directive& directive) {
  const bool named = directive.kind == K::kMakeNamedMaterial;
  const Parameter* const type = named ? directive.parameters.find("type", {ParameterType::kString}) : nullptr;
  const std::string kind = !named ? directive.names[0] : type && type->strings.size() == 1 ? type->strings[0] : "matte";
  ++statistics_.materials[kind.empty() ? "none" : kind];
  const uint32_t material = materials_.define(directive, context(directive.place));
  if (named)
    state_.named_materials.define(directive.names[0], material);
  else
    state_.attributes.material = material;
}

void SceneBuilder::handle_medium(const Directive& directive) {
  const bool defines = directive.kind == K::kMakeNamedMedium;
  ++statistics_.ignored[defines ? "media" : "medium_interfaces"];
  for (uint32_t i = 0; i < directive.name_count; ++i)
    if (!directive.names[i].empty()) // which stands for empty space
      (defines ? media_ : media_uses_).try_emplace(directive.names[i], directive.place);
}

void SceneBuilder::handle_named_material(const Directive& directive) {
  const std::optional<uint32_t> found = state_.named_materials.find(directive.names[0]);
  if (found)
    state_.attributes.material = *found;
  else
    reporter_.error(directive.place, "no named material " + in_quotes(directive.names[0]) +
                                         "; the material before it stays" +
                                         did_you_mean(state_.named_materials.closest(directive.names[0])));
}

void SceneBuilder::handle_texture(const Directive& directive) {
  const std::optional<TextureGraph::Node> node = make_texture(directive, context(directive.place));
  if (!node) return;
  (directive.names[1] == "float" ? state_.float_textures : state_.spectrum_textures).define(directive.names[0], *node);
}

void SceneBuilder::handle_area_light(const Directive& directive) {
  const std::string& kind = directive.names[0];
  if (kind != "diffuse" && kind != "area") // "area" is what pbrt-v2 files say
    return reporter_.error(directive.place, "unknown area light " + in_quotes(kind) + "; it is ignored");
  const TextureContext here = context(directive.place);
  const TextureParameters parameters(here, directive.parameters);
  const Vec3 radiance =
      parameters.constant_spectrum("L", Vec3(1.0f)) * parameters.constant_spectrum("scale", Vec3(1.0f));
  constexpr std::string_view kSampling[] = {"samples", "nsamples"};
  parameters.mark_used(kSampling);
  const bool both_sides = directive.parameters.get_bool("twosided", false);
  state_.attributes.area_light = radiance == Vec3(0.0f) ? kNone : both_sides ? 1 : 0;
  report_unused(directive.parameters, reporter_);
}

void SceneBuilder::begin_world(const Directive& directive) {
  if (phase_ == Phase::kWorld)
    return reporter_.error(directive.place, "WorldBegin inside the world block; it is ignored");
  phase_ = Phase::kWorld;
  ++statistics_.worlds;
  options_behind_world_.reset();
  if (!reading()) return;
  settle_time();
  state_.reset_transform();
  coordinate_systems_["world"] = state_.transform();
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
  const std::string end(end_keyword(kind)), begin(begin_keyword(kind));
  const auto top = [&]() -> const Block& { return state_.blocks().back(); };
  if (open_blocks_[static_cast<size_t>(kind)] == 0) {
    std::string message = end + " without " + begin;
    if (!state_.blocks().empty())
      message += "; the innermost open block is the " + std::string(begin_keyword(top().kind)) + " at " +
                 to_string(reporter_.locate(top().place));
    return reporter_.error(directive.place, std::move(message));
  }
  while (true) {
    const Block& block = top();
    const BlockKind closed = block.kind;
    if (closed != kind)
      reporter_.error(directive.place, end + " closes the " + std::string(begin_keyword(closed)) + " at " +
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
  const auto [it, inserted] = object_numbers_.try_emplace(directive.names[0], current_object_);
  if (!inserted) {
    reporter_.warning(directive.place, "object " + in_quotes(directive.names[0]) +
                                           " is defined again; later instances show the new one, unlike the one at " +
                                           to_string(reporter_.locate(object_places_[it->second])));
    it->second = current_object_;
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
  const auto found = object_numbers_.find(name);
  if (found == object_numbers_.end()) {
    std::string_view suggestion;
    if (object_numbers_.size() <= 1000) { // a hint is not worth more comparisons than that
      std::vector<std::string_view> names;
      for (const Object& object : scene_.objects) names.push_back(object.name);
      suggestion = closest_name(name, names);
    }
    return reporter_.error(directive.place,
                           "no object " + in_quotes(name) + "; the instance is skipped" + did_you_mean(suggestion));
  }
  const Placement placement = place(directive, "instance");
  const Affine world_from_object(placement.map);
  if (!is_invertible(DAffine(world_from_object)))
    return reporter_.error(directive.place, "the instance's transform has no inverse (a scale of 0?); it is skipped");
  if (placement.animation != kNotAnimated)
    scene_.animated_instances.push_back({static_cast<uint32_t>(scene_.instances.size()), placement.animation});
  scene_.instances.push_back({found->second, world_from_object});
}

SceneBuilder::Placement SceneBuilder::place(const Directive& directive, std::string_view thing) {
  const TransformPair& pair = state_.transform();
  if (!state_.animated()) return {pair.start, kNotAnimated};
  const std::optional<AnimatedTransform> keys = animate(pair.start, pair.end, transform_times_);
  if (!keys) {
    if (is_invertible(pair.start)) // else whoever asked reports it
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

/// Options are complete: says when everything is looked at.
void SceneBuilder::settle_time() {
  scene_.time = options_.time.value_or(cameras_.shutter_open());
  cameras_.settle(scene_.time, transform_times_, scene_.animations, reporter_);
}

void SceneBuilder::check_worlds(const Place& end) {
  const uint64_t worlds = statistics_.worlds;
  if (options_.world > std::max<uint64_t>(worlds, 1))
    throw Error(ErrorKind::kInput, to_string(reporter_.locate({end.file, 0, 0})) + ": there is no world " +
                                       std::to_string(options_.world) + ": the file has " + std::to_string(worlds));
  if (worlds == 0) return settle_time();
  if (worlds > 1)
    reporter_.note(end, "the file has " + std::to_string(worlds) + " worlds; world " + std::to_string(options_.world) +
                            " is read");
  if (phase_ != Phase::kOptions) return;
  phase_ = Phase::kDone;
  if (options_behind_world_)
    reporter_.warning(*options_behind_world_,
                      "what follows the last WorldEnd has no effect: options belong before their WorldBegin");
}

void SceneBuilder::report_media() {
  for (const auto& [name, place] : media_uses_)
    if (!media_.contains(name)) reporter_.error(place, "MediumInterface: no medium " + in_quotes(name));
  for (const auto& [name, place] : media_)
    if (!media_uses_.contains(name)) reporter_.note(place, "medium " + in_quotes(name) + " is never used");
}

std::vector<SceneBuilder::InstanceIdentity> SceneBuilder::animated_instances() const {
  std::vector<InstanceIdentity> identities;
  if (scene_.animated_instances.empty()) return identities;
  std::vector<uint32_t> counts(scene_.objects.size(), 0);
  auto next = scene_.animated_instances.begin();
  for (uint32_t i = 0; i < scene_.instances.size() && next != scene_.animated_instances.end(); ++i) {
    const uint32_t object = scene_.instances[i].object;
    const uint32_t ordinal = counts[object]++;
    if (next->instance != i) continue;
    identities.push_back({scene_.objects[object].shapes.data(), ordinal, next->animation});
    ++next;
  }
  return identities;
}

/// Points animated_instances at what is left of the instances, and leaves out animations that nothing has.
void SceneBuilder::renumber_animations(Scene& scene, const std::vector<InstanceIdentity>& instances) {
  if (scene.animations.empty()) return;
  std::map<std::pair<const Shape*, uint32_t>, uint32_t> animation_of;
  for (const InstanceIdentity& identity : instances)
    animation_of[{identity.shapes, identity.ordinal}] = identity.animation;
  std::vector<uint32_t> counts(scene.objects.size(), 0);
  scene.animated_instances.clear();
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const uint32_t object = scene.instances[i].object;
    const auto found = animation_of.find({scene.objects[object].shapes.data(), counts[object]++});
    if (found != animation_of.end()) scene.animated_instances.push_back({i, found->second});
  }

  const auto for_each_user = [&](auto function) {
    const auto visit = [&](auto& things) {
      for (auto& thing : things)
        if (thing.animation != kNotAnimated) function(thing.animation);
    };
    visit(scene.shapes);
    for (Object& object : scene.objects) visit(object.shapes);
    visit(scene.animated_instances);
    visit(scene.cameras);
  };
  std::vector<uint32_t> numbers(scene.animations.size(), kNotAnimated);
  for_each_user([&](uint32_t animation) { numbers[animation] = 0; });
  uint32_t count = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == kNotAnimated) continue;
    scene.animations[count] = scene.animations[i];
    numbers[i] = count++;
  }
  scene.animations.resize(count);
  for_each_user([&](uint32_t& animation) { animation = numbers[animation]; });
}

void SceneBuilder::count_features(ImportResult& result) {
  const Scene& scene = result.scene;
  ImportStatistics& statistics = result.statistics;
  const auto animated = [](const auto& thing) { return thing.animation != kNotAnimated; };
  const auto count = [&](const auto& things) {
    return static_cast<uint64_t>(std::count_if(things.begin(), things.end(), animated));
  };
  statistics.animated_shapes = count(scene.shapes);
  for (const Object& object : scene.objects) statistics.animated_shapes += count(object.shapes);
  statistics.animated_instances = scene.animated_instances.size();
  statistics.animated_cameras = count(scene.cameras);
  const auto bumps = std::count_if(scene.materials.begin(), scene.materials.end(),
                                   [](const Material& material) { return (material.flags & kNormalMap) != 0; });
  if (bumps > 0) statistics.ignored["bump_maps"] = static_cast<uint64_t>(bumps);
}

ImportResult SceneBuilder::result(const Place& end, Progress& progress) {
  check_worlds(end);
  report_media();
  const std::vector<InstanceIdentity> animated = animated_instances();
  ImportResult result = finish(end, progress);
  renumber_animations(result.scene, animated);
  count_features(result);
  return result;
}

} // namespace packtrace
