#include "pbrt_import/language/lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr std::string_view kLights[] = {"point", "spot", "distant", "infinite", "goniometric", "projection"};

/// A point parameter, which must be finite.
Vec3 point(const Directive& directive, const TextureContext& context, std::string_view name, Vec3 fallback) {
  const Vec3 value = directive.parameters.get_point(name, fallback);
  if (is_finite(value)) return value;
  context.reporter.error(directive.place, "parameter " + in_quotes("point " + std::string(name)) +
                                              " is not finite; its default is used");
  return fallback;
}

/// An angle in degrees.
float angle(const Directive& directive, const TextureContext& context, std::string_view name, float fallback) {
  const float value = directive.parameters.get_float(name, fallback);
  if (value >= 0.0f && value <= 180.0f) return value;
  context.reporter.error(directive.place, "parameter " + in_quotes("float " + std::string(name)) +
                                              " must lie within 0 and 180 degrees; its default is used");
  return fallback;
}

float cosine(float degrees) {
  return static_cast<float>(std::cos(static_cast<double>(degrees) * std::numbers::pi / 180.0));
}

/// The unit direction of a vector after a map; nullopt without one.
std::optional<Vec3> direction_of(const DAffine& map, DVec3 vector) {
  const DVec3 turned = transform_vector(map, vector);
  const double length = glm::length(turned);
  if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
  return Vec3(turned / length);
}

/// The orthonormal matrix nearest to a map, by its columns.
std::optional<glm::mat3> orthonormal(const DAffine& map) {
  glm::dmat3 m(map);
  for (int c = 0; c < 3; ++c) {
    for (int before = 0; before < c; ++before) m[c] -= m[before] * glm::dot(m[before], m[c]);
    const double length = glm::length(m[c]);
    if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
    m[c] /= length;
  }
  return glm::mat3(m);
}

bool is_turned_only(const DAffine& map) {
  const glm::dmat3 m(map);
  const double x = glm::length(m[0]), y = glm::length(m[1]), z = glm::length(m[2]);
  const double large = std::max({x, y, z}), small = std::min({x, y, z});
  const double skew =
      std::max({std::abs(glm::dot(m[0], m[1])), std::abs(glm::dot(m[0], m[2])), std::abs(glm::dot(m[1], m[2]))});
  return large - small <= 1e-3 * large && skew <= 1e-3 * large * large;
}

void read_spot(const Directive& directive, const TextureContext& context, float outer, float transition, Light& light) {
  light.kind = LightKind::kSpot;
  if (transition > outer) {
    context.reporter.warning(directive.place, "\"conedeltaangle\" is larger than \"coneangle\": the light falls off "
                                              "from its axis on");
    transition = outer;
  }
  light.cos_outer = cosine(outer), light.cos_inner = cosine(outer - transition);
}

} // namespace

std::optional<Vec3> light_brightness(const TextureParameters& parameters, std::string_view name) {
  const TextureContext& context = parameters.context();
  const Vec3 brightness =
      parameters.constant_spectrum(name, Vec3(1.0f)) * parameters.constant_spectrum("scale", Vec3(1.0f));
  if (!is_finite(brightness)) {
    context.reporter.error(context.place, "the light's brightness is out of range; the light is left out");
    return std::nullopt;
  }
  const Vec3 positive = glm::max(brightness, Vec3(0.0f));
  if (positive != brightness)
    context.reporter.warning(context.place, "the light's brightness has negative components; they count as 0");
  return positive;
}

void LightCollector::add(const Directive& directive, const TextureContext& context, const DAffine& world_from_light) {
  const std::string& kind = directive.names[0];
  const ParameterList& list = directive.parameters;
  const TextureParameters parameters(context, list);
  if (std::ranges::find(kLights, kind) == std::end(kLights))
    return context.reporter.error(directive.place, "unknown light " + in_quotes(kind) + "; it is left out" +
                                                       did_you_mean(closest_name(kind, kLights)));
  const bool far = kind == "distant" || kind == "infinite";
  const std::optional<Vec3> brightness = light_brightness(parameters, far ? "L" : "I");
  constexpr std::string_view kUnused[] = {"samples", "nsamples", "fov"};
  parameters.mark_used(kUnused);
  Light light;
  light.radiance = brightness.value_or(Vec3(0.0f));
  bool usable = true;
  if (kind == "infinite") {
    usable = read_infinite(directive, context, world_from_light, light);
  } else {
    const bool aims = kind == "spot" || kind == "distant";
    const Vec3 from = point(directive, context, "from", Vec3(0.0f));
    const Vec3 to = aims ? point(directive, context, "to", Vec3(0.0f, 0.0f, 1.0f)) : from + Vec3(0.0f, 0.0f, 1.0f);
    light.position = transform_point(world_from_light, DVec3(from));
    const DVec3 aim = kind == "distant" ? DVec3(from) - DVec3(to) : DVec3(to) - DVec3(from);
    const std::optional<Vec3> direction = direction_of(world_from_light, aim);
    light.direction = direction.value_or(Vec3(0.0f, 0.0f, 1.0f));
    if (kind == "distant") light.kind = LightKind::kDistant, light.position = DVec3(0.0);
    if (kind == "spot")
      read_spot(directive, context, angle(directive, context, "coneangle", 30.0f),
                angle(directive, context, "conedeltaangle", 5.0f), light);
    if (kind == "projection")
      read_spot(directive, context, 0.5f * angle(directive, context, "fov", 45.0f), 0.0f, light);
    usable = (!aims || direction) && is_finite(light.position);
    if (!usable) context.reporter.error(directive.place, "the light has no place or no direction; it is left out");
    if (kind == "goniometric" || kind == "projection") {
      constexpr std::string_view kImage[] = {"mapname"};
      parameters.mark_used(kImage);
      context.reporter.note(directive.place, kind + " light: its image is not used, it shines evenly" +
                                                 (kind == "projection" ? " as a spot" : ""));
    }
  }
  report_unused(list, context.reporter);
  if (usable && brightness && light.radiance != Vec3(0.0f)) lights_.push_back(light);
}

bool LightCollector::read_infinite(const Directive& directive, const TextureContext& context,
                                   const DAffine& world_from_light, Light& light) {
  light.kind = LightKind::kInfinite;
  const std::optional<glm::mat3> turned = orthonormal(world_from_light);
  if (!turned) {
    context.reporter.error(directive.place, "the light's transform has no inverse; the light is left out");
    return false;
  }
  if (!is_turned_only(world_from_light))
    context.reporter.note(directive.place, "infinite light: its transform does not only turn it; the rest is left out");
  light.world_from_light = *turned;
  if (const std::optional<uint32_t> map = read_map(directive, context)) light.map = *map;
  return true;
}

std::optional<uint32_t> LightCollector::read_map(const Directive& directive, const TextureContext& context) {
  const Parameter* const file = directive.parameters.find("mapname", {ParameterType::kString});
  if (!file) return std::nullopt;
  if (file->strings.size() != 1) {
    context.reporter.error(file->place, "parameter " + describe(*file) + " takes one file name; it is ignored");
    return std::nullopt;
  }
  const std::filesystem::path path = context.file_names.resolve(file->strings[0], file->place, context.reporter);
  if (path.empty()) return std::nullopt;
  const uint32_t request = context.graph.request_image(path, false, file->place, context.reporter.sequence());
  ImageRequest& image = context.graph.images()[request];
  image.needed = image.want_radiance = true;
  const auto found = std::ranges::find(maps_, request);
  if (found != maps_.end()) return static_cast<uint32_t>(found - maps_.begin());
  maps_.push_back(request);
  return static_cast<uint32_t>(maps_.size() - 1);
}

void LightCollector::finish(TextureGraph& graph, Scene& scene) {
  scene.lights = std::move(lights_);
  std::vector<uint32_t> numbers;
  for (const uint32_t request : maps_) {
    ImageRequest& image = graph.images()[request];
    numbers.push_back(image.missing ? kNoMap : static_cast<uint32_t>(scene.environment_maps.size()));
    if (image.missing) continue;
    scene.environment_maps.push_back({image.path.filename().string(), image.summary.map_width, image.summary.map_height,
                                      std::move(image.summary.radiance)});
  }
  for (Light& light : scene.lights)
    if (light.map != kNoMap) light.map = numbers[light.map];
}

} // namespace packtrace
