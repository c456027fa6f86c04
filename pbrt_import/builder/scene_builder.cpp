#include "pbrt_import/builder/scene_builder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pbrt_import/base/error.h"
#include "pbrt_import/language/textures.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

using K = DirectiveKind;

/// Estimate of the small allocations per directive: shapes, materials and names, but not the arrays of meshes. It is
/// higher than most directives need, because unused large pages cost less than page faults.
constexpr uint64_t kDirectiveBytes = 1024;

/// The part of the file in which a directive is allowed.
enum class Section : uint8_t { kAnywhere, kOptions, kWorld };

constexpr auto kSections = [] {
  std::array<Section, static_cast<size_t>(K::kWorldEnd) + 1> sections{};
  for (const K kind :
       {K::kAccelerator, K::kCamera, K::kFilm, K::kIntegrator, K::kPixelFilter, K::kSampler, K::kTransformTimes})
    sections[static_cast<size_t>(kind)] = Section::kOptions;
  for (const K kind :
       {K::kAttributeBegin, K::kAttributeEnd, K::kTransformBegin, K::kTransformEnd, K::kObjectBegin, K::kObjectEnd,
        K::kObjectInstance, K::kTexture, K::kMaterial, K::kMakeNamedMaterial, K::kNamedMaterial, K::kLightSource,
        K::kAreaLightSource, K::kShape, K::kReverseOrientation, K::kWorldEnd})
    sections[static_cast<size_t>(kind)] = Section::kWorld;
  return sections;
}();

} // namespace

SceneBuilder::SceneBuilder(const ImportOptions& options, FileNames& file_names, Reporter& reporter, Progress& progress)
    : options_(options), file_names_(file_names), reporter_(reporter), loader_(options, reporter),
      check_cancelled_([&progress] { progress.check_cancelled(); }), mesh_memory_(options.memory),
      kept_memory_(options.memory), mesh_queue_(options.tessellation_tolerance, check_cancelled_) {
  if (options.keep_shading) materials_.keep_shading();
}

bool SceneBuilder::allowed_here(const Directive& directive) {
  const Section section = kSections[static_cast<size_t>(directive.kind)];
  if (section == Section::kOptions && phase_ != Phase::kOptions) {
    reporter_.error(directive.place, std::string(directive.keyword) + " belongs before WorldBegin; it is ignored");
    return false;
  }
  if (section == Section::kWorld && phase_ != Phase::kWorld) {
    reporter_.error(directive.place,
                    std::string(directive.keyword) + " belongs between WorldBegin and WorldEnd; it is ignored");
    return false;
  }
  return true;
}

void SceneBuilder::handle(Directive& directive) {
  ++statistics_.directives;
  heap_pages_.about_to_allocate(kDirectiveBytes);
  if (!allowed_here(directive)) return;
  if (directive.kind == K::kWorldBegin) return begin_world(directive);
  if (directive.kind == K::kWorldEnd) return end_world(directive.place);
  if (phase_ == Phase::kOptions && statistics_.worlds > 0 && !options_after_world_)
    options_after_world_ = directive.place;
  if (!reading()) return record_unread_files(directive); // no output may replace the files of another world either
  count_kept(directive);
  if (directive.damaged)
    skip_damaged(directive);
  else
    execute_directive(directive);
}

/// Effects of a directive whose arguments the parser could not read, which it has reported.
void SceneBuilder::skip_damaged(Directive& directive) {
  switch (directive.kind) {
  case K::kTranslate:
  case K::kScale:
  case K::kRotate:
  case K::kLookAt:
  case K::kTransform:
  case K::kConcatTransform:
  case K::kCoordSysTransform:
    return state_.mark_transform_unknown();
  case K::kCamera:
    return cameras_.leave_out();
  case K::kObjectBegin: // opens the block, since its shapes do not belong to the world
    directive.names[0].clear();
    return begin_object(directive);
  case K::kShape:
    ++statistics_.shapes["unknown"];
    ++statistics_.shapes_skipped;
    return;
  default:
    return;
  }
}

/// Records files that belong to the scene although the import does not read them.
void SceneBuilder::record_unread_files(const Directive& directive) {
  for (const std::string_view name : {"mapname", "lensfile", "bsdffile", "filename"})
    if (const Parameter* const file = directive.parameters.peek(name, ParameterType::kString))
      for (const std::string& raw : file->strings) file_names_.mention(raw);
}

/// Counts an estimate of the memory that is kept of a directive, apart from large meshes; the data is spread over many
/// tables.
void SceneBuilder::count_kept(const Directive& directive) {
  uint64_t bytes = 0;
  switch (directive.kind) {
  case K::kShape:
  case K::kTexture:
    bytes = 512;
    break;
  case K::kMaterial:
  case K::kMakeNamedMaterial: // materials keep their parameters
    bytes = 512 + directive.memory.bytes();
    for (const Parameter& parameter : directive.parameters.all())
      bytes += sizeof parameter + parameter.floats.size() * sizeof(float);
    break;
  case K::kAttributeBegin:
  case K::kTransformBegin:
  case K::kObjectBegin:
  case K::kObjectInstance:
  case K::kCoordinateSystem:
  case K::kCamera:
  case K::kMakeNamedMedium:
  case K::kMediumInterface:
    bytes = 384;
    break;
  default:
    return;
  }
  for (uint32_t i = 0; i < directive.name_count; ++i) bytes += directive.names[i].size();
  count_kept(bytes);
}

void SceneBuilder::count_kept(uint64_t bytes) {
  kept_bytes_ += bytes;
  constexpr uint64_t kStep = 1u << 20;
  if (kept_bytes_ > kept_memory_.bytes() + kStep) kept_memory_.resize(kept_bytes_, "what the scene's text describes");
}

/// Longer than other functions: a table of all directives in one switch.
void SceneBuilder::execute_directive(Directive& directive) {
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
    record_unread_files(directive);
    define_coordinate_system(
        "camera", {inverse(state_.transform().start), inverse(state_.transform().end), state_.transform_known()});
    return cameras_.add_camera(directive, state_.transform(), reporter_);
  case K::kFilm:
    return cameras_.add_film(directive, reporter_);
  case K::kTexture:
    record_unread_files(directive);
    return handle_texture(directive);
  case K::kMaterial:
  case K::kMakeNamedMaterial:
    record_unread_files(directive);
    return handle_material(directive);
  case K::kNamedMaterial:
    return handle_named_material(directive);
  case K::kAreaLightSource:
    return handle_area_light(directive);
  case K::kLightSource:
    return handle_light(directive);
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
  case K::kWorldBegin: // dealt with in handle()
  case K::kWorldEnd:
  case K::kInclude: // dealt with in the parser
    return;
  }
}

void SceneBuilder::handle_transform(const Directive& directive) {
  const std::array<double, 16>& n = directive.numbers;
  if (const DVec3 offset(n[0], n[1], n[2]); directive.kind == K::kTranslate && is_finite(offset))
    return state_.translate(offset);
  const auto numbers_finite = [&](size_t count) {
    return std::all_of(n.begin(), n.begin() + static_cast<std::ptrdiff_t>(count),
                       [](double v) { return std::isfinite(v); });
  };
  size_t count = 0;
  std::optional<DAffine> map;
  std::string_view problem;
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
  if (!map) {
    state_.mark_transform_unknown();
    return reporter_.error(directive.place, std::string(directive.keyword) + " is ignored: " + std::string(problem));
  }
  if (directive.kind == K::kIdentity || directive.kind == K::kTransform)
    state_.set_transform(*map);
  else
    state_.concatenate(*map);
}

void SceneBuilder::handle_active_transform(const Directive& directive) {
  const std::string& which = directive.names[0];
  constexpr std::string_view kWhich[] = {"All", "StartTime", "EndTime"};
  const uint8_t bits = which == "All" ? 3 : which == "StartTime" ? 1 : which == "EndTime" ? 2 : 0;
  if (bits == 0)
    return reporter_.error(directive.place, "ActiveTransform takes All, StartTime or EndTime, found " +
                                                in_quotes(which) + did_you_mean(closest_name(which, kWhich)));
  state_.set_active(bits);
}

void SceneBuilder::handle_coordinate_system(const Directive& directive) {
  const std::string& name = directive.names[0];
  if (directive.kind == K::kCoordinateSystem) return define_coordinate_system(name, state_.transform());
  const std::optional<uint32_t> found = coordinate_system_names_.find(name);
  if (!found) {
    state_.mark_transform_unknown();
    return reporter_.error(directive.place,
                           "no coordinate system " + in_quotes(name) + "; the transform stays" +
                               did_you_mean(coordinate_system_names_.closest(name, [](uint32_t) { return true; })));
  }
  state_.set_transform(coordinate_systems_[*found]);
}

void SceneBuilder::define_coordinate_system(std::string_view name, const TransformPair& transform) {
  const uint32_t number = coordinate_system_names_.intern(name);
  if (number == coordinate_systems_.size()) coordinate_systems_.emplace_back();
  coordinate_systems_[number] = transform;
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
    if (!directive.names[i].empty()) // the empty name is vacuum
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

void SceneBuilder::handle_light(const Directive& directive) {
  record_unread_files(directive);
  ++statistics_.light_sources;
  if (!options_.keep_shading) {
    ++statistics_.ignored["light_sources"];
    return;
  }
  lights_.add(directive, context(directive.place), place(directive, "light").map);
}

void SceneBuilder::handle_area_light(const Directive& directive) {
  const std::string& kind = directive.names[0];
  constexpr std::string_view kAreaLights[] = {"diffuse", "area"};
  if (kind != "diffuse" && kind != "area") // "area" is pbrt-v2's name
    return reporter_.error(directive.place, "unknown area light " + in_quotes(kind) + "; it is ignored" +
                                                did_you_mean(closest_name(kind, kAreaLights)));
  const TextureContext here = context(directive.place);
  const TextureParameters parameters(here, directive.parameters);
  const Vec3 radiance = light_brightness(parameters, "L").value_or(Vec3(0.0f));
  constexpr std::string_view kSampling[] = {"samples", "nsamples"};
  parameters.mark_used(kSampling);
  const bool both_sides = directive.parameters.get_bool("twosided", false);
  state_.attributes.area_light = radiance == Vec3(0.0f) ? kNone : both_sides ? 1 : 0;
  state_.attributes.emission = options_.keep_shading && radiance != Vec3(0.0f) ? materials_.emission(radiance) : kNone;
  report_unused(directive.parameters, reporter_);
}

} // namespace packtrace
