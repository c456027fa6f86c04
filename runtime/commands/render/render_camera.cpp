#include "runtime/commands/render/render_camera.h"

#include <span>
#include <string_view>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/whole_number.h"
#include "runtime/frame/camera_path.h"
#include "runtime/view/view_camera.h"

namespace packtrace {
namespace {

constexpr ImageSize kDefaultSize{1280, 720};
constexpr std::string_view kLookAt = "lookat:";

/// The camera of "[I:]lookat:NUMBERS".
ChosenCamera placed_camera(const SceneSource& source, const std::string& name, ImageSize size) {
  const std::span<const Camera> cameras = source.cameras();
  const size_t at = name.find(kLookAt);
  const std::optional<uint32_t> number = at == 0 ? 0 : whole_number(std::string_view(name).substr(0, at - 1));
  if (!number || (at > 0 && name[at - 1] != ':'))
    throw Error(ErrorKind::kUsage, "--camera " + name + ": write I:lookat:..., with the number of a camera");
  if (*number > 0 && *number >= cameras.size())
    throw Error(ErrorKind::kUsage, fmt::format("--camera {}: the scene has no camera {}", name, *number));
  const Camera base = cameras.empty() ? framing_camera(source.world_bounds(), size, cameras) : cameras[*number];
  CameraKey key;
  key.up = glm::normalize(DVec3(base.world_from_camera[1]));
  key.fov_degrees = base.fov_degrees;
  try {
    key = parse_camera_key(name.substr(at + kLookAt.size()), key);
  } catch (const Error& error) {
    throw Error(error.kind(), std::string("--camera ").append(error.what()));
  }
  key.position -= source.origin(), key.look -= source.origin();
  return {camera_of_key(key, base), std::nullopt, {}};
}

} // namespace

ImageSize parse_size(const std::string& text) {
  const size_t cross = text.find_first_of("xX,");
  const std::string_view view(text);
  const auto width = cross == std::string::npos ? std::nullopt : whole_number(view.substr(0, cross));
  const auto height = width ? whole_number(view.substr(cross + 1)) : std::nullopt;
  if (!height) throw Error(ErrorKind::kUsage, "--size " + text + ": write WIDTHxHEIGHT, for example 1280x720");
  return {*width, *height};
}

ChosenCamera choose_camera(const SceneSource& source, const RenderOptions& options, const GlobalOptions& globals) {
  const std::span<const Camera> cameras = source.cameras();
  const ImageSize size = options.size.empty() ? kDefaultSize : parse_size(options.size);
  const std::string name = options.camera.value_or("0");
  if (name == "auto") return {framing_camera(source.world_bounds(), size, source.cameras()), std::nullopt, {}};
  if (name.find(kLookAt) != std::string::npos) return placed_camera(source, name, size);
  const std::optional<uint32_t> number = whole_number(name);
  if (!number)
    throw Error(ErrorKind::kUsage,
                "--camera " + name + ": must be a camera number, from 0, auto or lookat:PX,PY,PZ,LX,LY,LZ");
  const uint32_t index = *number;
  if (index < cameras.size()) return {cameras[index], index, {}};
  if (index > 0)
    throw Error(ErrorKind::kUsage, fmt::format("--camera {}: the scene has {} camera{}", index, cameras.size(),
                                               cameras.size() == 1 ? "" : "s"));
  if (!globals.quiet)
    print_printable(options.input + ": warning: the scene has no camera; showing the whole scene\n", stderr);
  return {framing_camera(source.world_bounds(), size, source.cameras()), std::nullopt, "the scene has no camera"};
}

ChosenCamera frame_whole_scene(const ChosenCamera& blind, const SceneSource& source, ImageSize size,
                               const RenderOptions& options, const GlobalOptions& globals) {
  ChosenCamera framing{framing_camera(source.world_bounds(), size, source.cameras()), std::nullopt,
                       fmt::format("camera {} sees nothing", blind.index.value())};
  if (!globals.quiet)
    print_printable(
        fmt::format("{}: warning: {} of the scene; showing the whole scene (--camera {} keeps the camera)\n",
                    options.input, framing.reason, *blind.index),
        stderr);
  return framing;
}

} // namespace packtrace
