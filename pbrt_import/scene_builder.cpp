#include "pbrt_import/scene_builder.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/textures.h"
#include "pbrt_import/tokenizer.h"
#include "pbrt_import/transforms.h"

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

SceneBuilder::SceneBuilder(const ImportOptions& options, const FileNames& file_names, Reporter& reporter,
                           Progress& progress)
    : options_(options), file_names_(file_names), reporter_(reporter), loader_(options, reporter),
      check_cancelled_([&progress] { progress.check_cancelled(); }),
      mesh_queue_(options.tessellation_tolerance, check_cancelled_) {}

bool SceneBuilder::allowed_here(const Directive& directive) {
  if (phase_ == Phase::kSecondWorld) return false;
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
    return cameras_.add_camera(directive, state_.transform().start, reporter_);
  case K::kFilm:
    return cameras_.add_film(directive, reporter_);
  case K::kTexture:
    return handle_texture(directive);
  case K::kMaterial:
    state_.attributes.material = materials_.define(directive, context(directive.place));
    return;
  case K::kMakeNamedMaterial:
    return state_.named_materials.define(directive.names[0], materials_.define(directive, context(directive.place)));
  case K::kNamedMaterial:
    return handle_named_material(directive);
  case K::kAreaLightSource:
    return handle_area_light(directive);
  case K::kLightSource:
    ++statistics_.light_sources;
    return;
  case K::kReverseOrientation:
    state_.attributes.reverse_orientation = !state_.attributes.reverse_orientation;
    return;
  case K::kShape:
    return add_shape(directive);
  case K::kWorldBegin:
    return begin_world(directive);
  case K::kWorldEnd:
    return end_world(directive.place);
  case K::kAccelerator:
  case K::kIntegrator:
  case K::kPixelFilter:
  case K::kSampler:
  case K::kTransformTimes:
  case K::kMakeNamedMedium:
  case K::kMediumInterface:
  case K::kInclude:
    return; // nothing that ambient occlusion depends on
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
  if (phase_ == Phase::kDone) {
    phase_ = Phase::kSecondWorld;
    return reporter_.error(directive.place,
                           "a second world block: only the first one is imported, all from here on is ignored");
  }
  phase_ = Phase::kWorld;
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
  phase_ = Phase::kDone;
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
  const Affine world_from_object(state_.transform().start);
  if (!is_invertible(DAffine(world_from_object)))
    return reporter_.error(directive.place, "the instance's transform has no inverse (a scale of 0?); it is skipped");
  if (state_.animated()) reporter_.note(directive.place, "animated instance: its transform at the start is used");
  // Room that is never used costs address space only, where copies would cost memory while they are made.
  if (scene_.instances.size() == scene_.instances.capacity())
    scene_.instances.reserve(std::max<size_t>(1024, 4 * scene_.instances.size()));
  scene_.instances.push_back({found->second, world_from_object});
}

} // namespace packtrace
