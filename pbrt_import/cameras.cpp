#include "pbrt_import/cameras.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/tokenizer.h"
#include "pbrt_import/transforms.h"

namespace packtrace {
namespace {

constexpr double kDefaultFovDegrees = 90.0;

double read_fov(const Directive& directive, Reporter& reporter) {
  const ParameterList& list = directive.parameters;
  const double fov = list.get_float("fov", static_cast<float>(kDefaultFovDegrees));
  const double half = list.get_float("halffov", -1.0f);
  const double degrees = half > 0.0 ? 2.0 * half : fov;
  if (degrees > 0.0 && degrees < 180.0) return degrees;
  reporter.error(directive.place, "the camera's field of view must lie between 0 and 180 degrees; 90 is used");
  return kDefaultFovDegrees;
}

std::optional<glm::dvec4> read_screen_window(const Directive& directive, Reporter& reporter) {
  const std::span<const float> window = directive.parameters.floats("screenwindow", ParameterType::kFloat);
  if (window.empty()) return std::nullopt;
  const bool usable = window.size() == 4 && window[0] != window[1] && window[2] != window[3] &&
                      is_finite(Vec3(window[0], window[1], window[2])) && std::isfinite(window[3]);
  if (usable) return glm::dvec4(window[0], window[1], window[2], window[3]);
  reporter.error(directive.place,
                 "screenwindow takes four finite numbers x0 x1 y0 y1 that span an area; it is ignored");
  return std::nullopt;
}

} // namespace

void CameraCollector::add_camera(const Directive& directive, const DAffine& camera_from_world, Reporter& reporter) {
  const std::string& kind = directive.names[0];
  Entry entry;
  Camera& camera = entry.camera;
  if (kind == "orthographic") {
    camera.projection = Projection::kOrthographic;
  } else if (kind == "environment") {
    camera.projection = Projection::kEnvironment;
  } else if (kind != "perspective") {
    const bool realistic = kind == "realistic";
    reporter.report(realistic ? Severity::kWarning : Severity::kError, directive.place,
                    realistic ? "realistic cameras are not supported; a perspective camera of 45 degrees stands for it"
                              : "unknown camera " + in_quotes(kind) + "; it is left out");
    if (!realistic) return;
    camera.fov_degrees = 45.0;
    constexpr std::string_view kLens[] = {"lensfile", "aperturediameter", "focusdistance", "simpleweighting"};
    directive.parameters.mark_used(kLens);
  }
  constexpr std::string_view kUnneeded[] = {"shutteropen", "shutterclose", "lensradius", "focaldistance"};
  directive.parameters.mark_used(kUnneeded);
  if (kind == "perspective") camera.fov_degrees = read_fov(directive, reporter);
  camera.screen_window = read_screen_window(directive, reporter);
  const float aspect = directive.parameters.get_float("frameaspectratio", 0.0f);
  if (aspect > 0.0f && std::isfinite(aspect)) entry.frame_aspect = aspect;
  report_unused(directive.parameters, reporter);
  if (!is_invertible(camera_from_world)) {
    reporter.error(directive.place, "the camera's transform has no inverse; the camera is left out");
    return;
  }
  camera.world_from_camera = inverse(camera_from_world);
  entries_.push_back(std::move(entry));
}

void CameraCollector::add_film(const Directive& directive, Reporter& reporter) {
  const ParameterList& list = directive.parameters;
  constexpr std::string_view kUnneeded[] = {"scale", "diagonal", "maxsampleluminance"};
  list.mark_used(kUnneeded);
  if (directive.names[0] != "image")
    reporter.error(directive.place, "unknown film " + in_quotes(directive.names[0]) + "; read as \"image\"");
  Film film;
  film.name = list.get_string("filename", film.name);
  const auto read_side = [&](std::string_view name, uint32_t& side) {
    constexpr int32_t kMostPixels = 1 << 16;
    const int32_t pixels = list.get_integer(name, static_cast<int32_t>(side));
    if (pixels >= 1 && pixels <= kMostPixels)
      side = static_cast<uint32_t>(pixels);
    else
      reporter.error(directive.place, std::string(name) + " must lie between 1 and " + std::to_string(kMostPixels) +
                                          "; " + std::to_string(side) + " is used");
  };
  read_side("xresolution", film.width_px);
  read_side("yresolution", film.height_px);
  if (list.find("cropwindow", {ParameterType::kFloat}))
    reporter.note(directive.place, "the film's cropwindow is ignored: the whole picture is rendered");
  report_unused(list, reporter);
  last_film_ = film;
  if (!entries_.empty()) entries_.back().film = film;
}

std::vector<Camera> CameraCollector::finish() const {
  std::vector<Camera> cameras;
  const Film* before = nullptr;
  for (const Entry& entry : entries_) {
    Camera camera = entry.camera;
    // Without any film after the first camera, last_film_ is the one before it, or the default.
    const Film& film = entry.film ? *entry.film : before ? *before : last_film_;
    before = &film;
    camera.width_px = film.width_px;
    camera.height_px = film.height_px;
    camera.film_name = film.name;
    if (entry.frame_aspect && !camera.screen_window) {
      const double a = *entry.frame_aspect;
      camera.screen_window = a >= 1.0 ? glm::dvec4(-a, a, -1.0, 1.0) : glm::dvec4(-1.0, 1.0, -1.0 / a, 1.0 / a);
    }
    cameras.push_back(std::move(camera));
  }
  if (cameras.size() > 1) std::rotate(cameras.begin(), cameras.end() - 1, cameras.end());
  return cameras;
}

} // namespace packtrace
