#include "runtime/commands/sequence/sequence_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/world_view.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/render/camera_path_file.h"
#include "runtime/commands/sequence/sequence_names.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxSubframes = 4096;
constexpr double kDefaultSeconds = 4.0;

/// Distance along the view at which a camera sees most of what is in the middle of its picture: the median depth of the
/// middle quarter. Where it sees nothing, the distance of the scene's centre.
double view_distance(const Camera& camera, double time_s, const SceneSource& source, FrameLoop& loop) {
  Progress unseen;
  loop.next_frame(camera, time_s, unseen);
  const GBuffer& g = loop.gbuffer();
  std::vector<float> depths;
  for (uint32_t y = g.size.height / 4; y < g.size.height - g.size.height / 4; ++y)
    for (uint32_t x = g.size.width / 4; x < g.size.width - g.size.width / 4; ++x)
      if (const float z = g.view_z[size_t{y} * g.size.width + x]; z > 0.0f) depths.push_back(z);
  loop.reset();
  const PrimaryCamera view(camera, g.size);
  if (depths.empty()) return std::max(view.view_z(source.world_bounds().centre()), 0.0);
  const auto middle = depths.begin() + static_cast<ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return double{*middle};
}

/// The pictures of a camera that turns about a vertical line. Whole turns end one step before the start, so that they
/// can be repeated; other angles are reached by the last picture.
std::function<Camera(uint64_t)> turning(const Camera& camera, DVec3 pivot, DVec3 up, double degrees,
                                        uint64_t pictures) {
  const bool whole = std::fmod(degrees, 360.0) == 0.0;
  const double steps = static_cast<double>(whole ? pictures : std::max<uint64_t>(pictures - 1, 1));
  return [=](uint64_t picture) { return orbited(camera, pivot, up, degrees * static_cast<double>(picture) / steps); };
}

bool is_orbit(std::string_view path) { return path == "orbit" || path.starts_with("orbit:"); }

double orbit_degrees(std::string_view path) {
  if (path == "orbit") return 360.0;
  const std::string_view digits = path.substr(std::string_view("orbit:").size());
  double degrees = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), degrees);
  if (error != std::errc() || end != digits.data() + digits.size() || !(std::abs(degrees) <= 36'000.0))
    throw Error(ErrorKind::kUsage,
                fmt::format("--path {}: write an angle of at most 36000 degrees, such as orbit:90", path));
  return degrees;
}

uint64_t default_pictures(double seconds, double fps) {
  return static_cast<uint64_t>(std::clamp(std::floor(seconds * fps + 0.5), 1.0, static_cast<double>(kMaxPictures)));
}

} // namespace

void add_sequence_options(CLI::App& verb, SequenceOptions& options) {
  constexpr const char* kGroup = "Sequences";
  verb.add_option("--path", options.path,
                  "Render a sequence of pictures along a path of the camera: orbit[:DEGREES] turns it about what it "
                  "looks at (default 360), turntable shows the whole scene from all sides, scene keeps the scene's "
                  "camera, which may move, and FILE.json holds keys (docs/frames.md)")
      ->type_name("PATH")
      ->group(kGroup);
  verb.add_option("--fps", options.fps, "Pictures per second, in (0, 1000] (default 24)")
      ->type_name("F")
      ->group(kGroup);
  verb.add_option("--subframes", options.subframes,
                  "Frames per picture, 1..4096 (default 8). Each traces --spp rays per pixel with its own shift of the "
                  "camera rays; more give smoother edges and less noise")
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--keys", options.keys,
                  "Move instances by the keys of a JSON file (docs/motion.md), in addition to the scene's own motion")
      ->type_name("FILE")
      ->group(kGroup);
  verb.add_option("--start-time", options.start_time,
                  "Time of the still or of the first picture in seconds (default: the first key of the path, else of "
                  "the scene's motion). A still without it shows "
                  "the scene at rest")
      ->type_name("S")
      ->group(kGroup);
  verb.add_flag("--resume", options.resume,
                "Continue an interrupted sequence of numbered files: the result is the same as without interruption")
      ->group(kGroup);
  verb.add_option("--checkpoint", options.checkpoint,
                  "Save the state for --resume after as many seconds, 0 for every picture (default 10)")
      ->type_name("S")
      ->group(kGroup);
  verb.add_option("--stream", options.stream,
                  "Format of -o - : y4m is uncompressed video for an encoder; png writes one PNG after another "
                  "(default y4m)")
      ->check(one_of({"y4m", "png"}))
      ->group(kGroup);
  verb.add_option("--csv", options.csv, "Write a table of the pictures' pass times, rays, history and levels of detail")
      ->type_name("FILE")
      ->group(kGroup);
}

void validate(const SequenceOptions& options) {
  if (!options.path &&
      (options.fps || options.subframes || options.resume || options.checkpoint || options.stream || options.csv))
    throw Error(ErrorKind::kUsage, "--fps, --subframes, --resume, --checkpoint, --stream and --csv require --path");
  if (options.checkpoint && !(*options.checkpoint >= 0.0))
    throw Error(ErrorKind::kUsage, "--checkpoint: must be a number of seconds, 0 or more");
  if (options.fps && !(*options.fps > 0.0 && *options.fps <= 1000.0))
    throw Error(ErrorKind::kUsage, fmt::format("--fps {}: must be above 0 and at most 1000", *options.fps));
  if (options.subframes && (*options.subframes < 1 || *options.subframes > kMaxSubframes))
    throw Error(ErrorKind::kUsage, fmt::format("--subframes {}: must be in [1, 4096]", *options.subframes));
  if (options.start_time && !std::isfinite(*options.start_time))
    throw Error(ErrorKind::kUsage, "--start-time: must be finite");
}

double start_time(const SequenceOptions& options, const SceneMotion* motion) {
  return options.start_time.value_or(motion != nullptr ? motion->begin_s() : 0.0);
}

bool begins_with_still_camera(const SequenceOptions& options, uint32_t index, const SceneMotion* motion) {
  if (is_orbit(*options.path)) return true;
  return *options.path == "scene" && (motion == nullptr || !motion->camera(index, start_time(options, motion)));
}

Sequence make_sequence(const SequenceOptions& options, std::optional<uint64_t> pictures, const SceneSource& source,
                       const Camera& camera, std::optional<uint32_t> index, FrameLoop& loop,
                       const MemoryBudget& memory) {
  Sequence sequence;
  sequence.fps = options.fps.value_or(sequence.fps);
  sequence.subframes = options.subframes.value_or(sequence.subframes);
  const SceneMotion* const motion = loop.scene().motion;
  sequence.start_s = start_time(options, motion);
  if (pictures && (*pictures < 1 || *pictures > kMaxPictures))
    throw Error(ErrorKind::kUsage,
                fmt::format("--frames {}: a sequence has 1 to {} pictures", *pictures, kMaxPictures));
  sequence.pictures = pictures.value_or(default_pictures(kDefaultSeconds, sequence.fps));
  const std::string& path = *options.path;
  const DVec3 up = estimate_world_view(source.cameras()).up;
  if (path == "scene") {
    if (!pictures && motion != nullptr && motion->end_s() > sequence.start_s)
      sequence.pictures = default_pictures(motion->end_s() - sequence.start_s, sequence.fps);
    const double start_s = sequence.start_s, fps = sequence.fps;
    sequence.camera = [=](uint64_t i) {
      const double time_s = start_s + static_cast<double>(i) / fps;
      const auto moving = motion != nullptr && index ? motion->camera(*index, time_s) : std::nullopt;
      return moving.value_or(camera);
    };
  } else if (path == "turntable") {
    const Camera framing = framing_camera(source.world_bounds(), loop.config().size, source.cameras());
    sequence.camera = turning(framing, source.world_bounds().centre(), up, 360.0, sequence.pictures);
  } else if (is_orbit(path)) {
    const double degrees = orbit_degrees(path);
    const DVec3 forward = glm::normalize(DVec3(camera.world_from_camera[2]));
    const DVec3 pivot =
        DVec3(camera.world_from_camera[3]) + forward * view_distance(camera, sequence.start_s, source, loop);
    sequence.camera = turning(camera, pivot, up, degrees, sequence.pictures);
  } else {
    if (ending_of(path) != ".json")
      throw Error(ErrorKind::kUsage, fmt::format("--path {}: must be orbit, orbit:DEGREES, turntable, scene or a .json "
                                                 "file of camera keys",
                                                 path));
    const CameraPath keys = read_camera_path(path, camera, source.origin(), memory);
    if (!options.start_time) sequence.start_s = keys.begin_s();
    if (!pictures) sequence.pictures = default_pictures(keys.end_s() - sequence.start_s, sequence.fps);
    const double start_s = sequence.start_s, fps = sequence.fps;
    sequence.camera = [keys, start_s, fps](uint64_t i) { return keys.at(start_s + static_cast<double>(i) / fps); };
  }
  return sequence;
}

} // namespace packtrace
