#include "runtime/commands/render_camera.h"

#include <span>
#include <string_view>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/whole_number.h"

namespace packtrace {
namespace {

constexpr ImageSize kDefaultSize{1280, 720};

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
  const std::optional<uint32_t> number = whole_number(name);
  if (!number) throw Error(ErrorKind::kUsage, "--camera " + name + ": must be a camera number, from 0, or auto");
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
