#include "pbrt_import/language/cameras.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/text/tokenizer.h"

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

/// pbrt's default screen window for a film aspect ratio (width / height): [-1, 1] along the shorter axis.
glm::dvec4 window_of_aspect(double a) {
  return a >= 1.0 ? glm::dvec4(-a, a, -1.0, 1.0) : glm::dvec4(-1.0, 1.0, -1.0 / a, 1.0 / a);
}

void read_shutter(const Directive& directive, Camera& camera, Reporter& reporter) {
  float open = directive.parameters.get_float("shutteropen", 0.0f);
  float close = directive.parameters.get_float("shutterclose", 1.0f);
  if (!std::isfinite(open) || !std::isfinite(close)) {
    reporter.error(directive.place, "shutteropen and shutterclose must be finite; 0 and 1 are used");
    open = 0.0f, close = 1.0f;
  }
  if (close < open) {
    reporter.warning(directive.place, "the shutter closes before it opens; its times are swapped");
    std::swap(open, close);
  }
  camera.shutter_open = open;
  camera.shutter_close = close;
}

} // namespace

void CameraCollector::add_camera(const Directive& directive, const TransformPair& camera_from_world,
                                 Reporter& reporter) {
  const std::string& kind = directive.names[0];
  const ParameterList& list = directive.parameters;
  Entry entry;
  entry.place = directive.place;
  Camera& camera = entry.camera;
  if (kind == "orthographic") {
    camera.projection = Projection::kOrthographic;
  } else if (kind == "environment") {
    camera.projection = Projection::kEnvironment;
  } else if (kind != "perspective") {
    constexpr std::string_view kCameras[] = {"perspective", "orthographic", "environment", "realistic"};
    const bool realistic = kind == "realistic";
    reporter.report(realistic ? Severity::kWarning : Severity::kError, directive.place,
                    realistic ? "realistic cameras are not supported; a perspective camera of 45 degrees stands for it"
                              : "unknown camera " + in_quotes(kind) + "; it is left out" +
                                    did_you_mean(closest_name(kind, kCameras)));
    if (!realistic) return leave_out();
    ++ignored_["realistic_cameras"];
    camera.fov_degrees = 45.0;
    constexpr std::string_view kLens[] = {"lensfile", "aperturediameter", "focusdistance", "simpleweighting"};
    list.mark_used(kLens);
  }
  read_shutter(directive, camera, reporter);
  constexpr std::string_view kUnneeded[] = {"focaldistance"};
  list.mark_used(kUnneeded);
  if (list.get_float("lensradius", 0.0f) > 0.0f && camera.projection != Projection::kEnvironment) {
    ++ignored_["lenses"];
    reporter.note(directive.place, "the camera's lensradius is ignored: everything is in focus");
  }
  if (kind == "perspective") camera.fov_degrees = read_fov(directive, reporter);
  camera.screen_window = read_screen_window(directive, reporter);
  if (list.find("frameaspectratio", {ParameterType::kFloat})) {
    const float aspect = list.get_float("frameaspectratio", 0.0f);
    if (aspect > 0.0f && std::isfinite(aspect))
      entry.frame_aspect = aspect;
    else
      reporter.error(directive.place, "frameaspectratio must be one positive number; the film's is used");
  }
  report_unused(list, reporter);
  // A map that flattens space can count as invertible through rounding alone; its inverse may then not be invertible.
  if (!is_invertible(camera_from_world.start) || !is_invertible(inverse(camera_from_world.start))) {
    reporter.error(directive.place, "the camera's transform has no inverse; the camera is left out");
    return leave_out();
  }
  if (!camera_from_world.known) {
    reporter.error(directive.place, "a transform before the camera is ignored, so that nobody knows where it stands; "
                                    "the camera is left out");
    return leave_out();
  }
  entry.world_from_camera.start = inverse(camera_from_world.start);
  entry.world_from_camera.end = inverse(camera_from_world.end);
  camera.world_from_camera = entry.world_from_camera.start;
  entry.track = directive.motion.track;
  entries_.push_back(std::move(entry));
}

void CameraCollector::read_crop_window(const Directive& directive, Film& film, Reporter& reporter) {
  film.columns = {0, film.width_px};
  film.rows = {0, film.height_px};
  const std::span<const float> crop = directive.parameters.floats("cropwindow", ParameterType::kFloat);
  if (crop.empty()) return;
  if (crop.size() != 4) {
    reporter.error(directive.place, "cropwindow takes four numbers x0 x1 y0 y1, found " + std::to_string(crop.size()) +
                                        "; it is ignored");
    return;
  }
  // pbrt rounds in float, and rounds both ends up.
  const auto pixels = [](uint32_t side, float a, float b) {
    const auto edge = [&](float share) {
      return static_cast<uint32_t>(std::ceil(static_cast<float>(side) * std::clamp(share, 0.0f, 1.0f)));
    };
    return PixelRange{edge(std::min(a, b)), edge(std::max(a, b))};
  };
  const bool numbers = std::none_of(crop.begin(), crop.end(), [](float share) { return std::isnan(share); });
  const PixelRange columns = numbers ? pixels(film.width_px, crop[0], crop[1]) : PixelRange{};
  const PixelRange rows = numbers ? pixels(film.height_px, crop[2], crop[3]) : PixelRange{};
  if (columns.begin == columns.end || rows.begin == rows.end) {
    reporter.error(directive.place, "the cropwindow holds no pixel; it is ignored");
    return;
  }
  film.columns = columns;
  film.rows = rows;
}

void CameraCollector::add_film(const Directive& directive, Reporter& reporter) {
  const ParameterList& list = directive.parameters;
  constexpr std::string_view kUnneeded[] = {"scale", "diagonal", "maxsampleluminance"};
  list.mark_used(kUnneeded);
  if (directive.names[0] != "image")
    reporter.error(directive.place, "unknown film " + in_quotes(directive.names[0]) + "; read as \"image\"");
  Film film;
  film.place = directive.place;
  film.name = list.get_string("filename", film.name);
  const auto read_side = [&](std::string_view name, uint32_t& side) {
    constexpr int32_t kMaxPixels = 1 << 16;
    const int32_t pixels = list.get_integer(name, static_cast<int32_t>(side));
    if (pixels >= 1 && pixels <= kMaxPixels)
      side = static_cast<uint32_t>(pixels);
    else
      reporter.error(directive.place, std::string(name) + " must lie between 1 and " + std::to_string(kMaxPixels) +
                                          "; " + std::to_string(side) + " is used");
  };
  read_side("xresolution", film.width_px);
  read_side("yresolution", film.height_px);
  read_crop_window(directive, film, reporter);
  report_unused(list, reporter);
  last_film_ = film;
  if (!entries_.empty()) entries_.back().film = film;
}

void CameraCollector::animate_camera(Entry& entry, double time, TransformTimes times,
                                     std::vector<AnimatedTransform>& animations, Reporter& reporter) {
  const TransformPair& pair = entry.world_from_camera;
  if (pair.start == pair.end) return;
  const auto stays = [&](const std::string& when) {
    reporter.error(entry.place,
                   "animated camera: its transform at " + when + " has no inverse; it stands as at its start");
  };
  const std::optional<AnimatedTransform> keys = animate(pair.start, pair.end, times);
  if (!keys) return stays("EndTime");
  const DAffine map = interpolate(*keys, time);
  if (!is_invertible(map)) return stays("time " + to_text(time));
  reporter.note(entry.place, "animated camera: it stands as at time " + to_text(time));
  entry.camera.world_from_camera = map;
  entry.camera.animation = static_cast<uint32_t>(animations.size());
  animations.push_back(*keys);
}

void CameraCollector::fit_to_film(Entry& entry, const Film& film, Reporter& reporter) {
  Camera& camera = entry.camera;
  camera.width_px = film.width_px;
  camera.height_px = film.height_px;
  camera.film_name = film.name;
  if (camera.projection == Projection::kEnvironment) { // covers all directions regardless of windows
    camera.screen_window.reset();
    if (!film.cropped()) return;
    ++ignored_["environment_crops"];
    return reporter.note(film.place, "the cropwindow of an environment camera is ignored: it sees all directions");
  }
  if (entry.frame_aspect && !camera.screen_window) camera.screen_window = window_of_aspect(*entry.frame_aspect);
  if (!film.cropped()) return;
  // A crop is a smaller film with a smaller window, so its pixels have the same rays as in the full image.
  const double film_width = film.width_px, film_height = film.height_px;
  const glm::dvec4 whole = camera.screen_window.value_or(window_of_aspect(film_width / film_height));
  const auto x = [&](uint32_t column) { return whole.x + (whole.y - whole.x) * column / film_width; };
  const auto y = [&](uint32_t row) { return whole.w + (whole.z - whole.w) * row / film_height; };
  camera.screen_window = glm::dvec4(x(film.columns.begin), x(film.columns.end), y(film.rows.end), y(film.rows.begin));
  camera.width_px = film.columns.end - film.columns.begin;
  camera.height_px = film.rows.end - film.rows.begin;
}

void CameraCollector::settle(double time, TransformTimes times, std::vector<AnimatedTransform>& animations,
                             Reporter& reporter) {
  const Film* before = nullptr;
  for (Entry& entry : entries_) {
    // If no film follows the first camera, last_film_ is the film before it or the default.
    const Film& film = entry.film ? *entry.film : before ? *before : last_film_;
    before = &film;
    fit_to_film(entry, film, reporter);
    animate_camera(entry, time, times, animations, reporter);
  }
}

std::vector<uint32_t> CameraCollector::tracks() const {
  std::vector<uint32_t> tracks;
  for (const Entry& entry : entries_) tracks.push_back(entry.track);
  if (tracks.size() > 1) std::rotate(tracks.begin(), tracks.end() - 1, tracks.end());
  return tracks;
}

std::vector<Camera> CameraCollector::finish() const {
  std::vector<Camera> cameras;
  for (const Entry& entry : entries_) cameras.push_back(entry.camera);
  if (cameras.size() > 1) std::rotate(cameras.begin(), cameras.end() - 1, cameras.end());
  return cameras;
}

} // namespace packtrace
