// Rendering to numpy arrays.

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/error.h"
#include "runtime/frame/ao_names.h"
#include "runtime/frame/still.h"
#include "runtime/frame/view_layers.h"
#include "runtime/python/bindings.h"
#include "runtime/trace/source/packed_source.h"

namespace py = pybind11;

namespace packtrace {
namespace {

/// An array of height x width pixels that takes over the values.
template <typename T>
py::array pixels(std::vector<T>&& values, ImageSize size) {
  constexpr bool kVector = std::is_same_v<T, Vec3> || std::is_same_v<T, Vec2>;
  using Number = std::conditional_t<kVector, float, T>;
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(size.height), static_cast<py::ssize_t>(size.width)};
  if (kVector) shape.push_back(sizeof(T) / sizeof(float));
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  const auto* data = reinterpret_cast<const Number*>(kept->data());
  const py::capsule owner(kept.get(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  kept.release(); // the capsule deletes it
  return py::array_t<Number>(shape, data, owner);
}

Camera chosen_camera(const SceneSource& source, std::optional<int64_t> index, ImageSize size) {
  const auto count = static_cast<int64_t>(source.cameras().size());
  if (!index || (*index == 0 && count == 0)) return framing_camera(source.world_bounds(), size, source.cameras());
  if (*index < 0 || *index >= count)
    throw Error(ErrorKind::kUsage, "camera=" + std::to_string(*index) + ": the file has " + std::to_string(count));
  return source.cameras()[static_cast<size_t>(*index)];
}

/// The denoiser argument of render().
struct DenoiserChoice {
  bool denoise = true;
  std::string preset;
  std::map<std::string, double> settings;
};

void set_denoiser(StillConfig& config, const DenoiserChoice& choice) {
  if (choice.preset != "ours" && choice.preset != "reference" && choice.preset != "off")
    throw Error(ErrorKind::kUsage, "denoiser=\"" + choice.preset + "\": choose one of ours, reference, off");
  config.denoise = choice.denoise && choice.preset != "off";
  if (!config.denoise && !choice.settings.empty())
    throw Error(ErrorKind::kUsage, "denoiser_settings change nothing without the denoiser");
  if (choice.preset == "reference") config.denoiser.kind = DenoiserKind::kReference;
  for (const auto& [name, value] : choice.settings) config.denoiser.set(name + "=" + setting_text(value));
  config.denoiser.validate();
}

/// How occlusion rays are spent; settings by name, as `packtrace render --ao-set`.
struct AoChoice {
  std::optional<float> radius;
  std::string resolution, rate, sampler;
  std::map<std::string, double> settings;
};

void set_ao(StillConfig& config, const AoChoice& choice) {
  if (choice.radius) config.ao.radius = *choice.radius;
  config.ao_resolution = value_of(kAoResolutionNames, choice.resolution, "ao_resolution");
  config.ao_rate = value_of(kAoRateNames, choice.rate, "ao_rate");
  config.ao.sampler = value_of(kAoSamplerNames, choice.sampler, "ao_sampler");
  for (const auto& [name, value] : choice.settings)
    assign_setting(ao_settings(), name + "=" + setting_text(value), config.ao, "ambient occlusion");
}

/// What is rendered; settings by name, as `packtrace render --shade-set`.
void set_shading(StillConfig& config, const std::string& view, const std::map<std::string, double>& settings) {
  constexpr std::array<std::pair<const char*, FrameView>, 3> kViews{
      {{"ao", FrameView::kAo}, {"pbr", FrameView::kPbr}, {"pbr+ao", FrameView::kPbrAo}}};
  config.view = value_of(kViews, view, "view");
  if (!config.shades() && !settings.empty())
    throw Error(ErrorKind::kUsage, "shade_settings change nothing with view=\"ao\"");
  for (const auto& [name, value] : settings)
    assign_setting(shade_settings(), name + "=" + setting_text(value), config.shade, "shading");
}

/// Whether a layer is one of those that FrameConfig::view_layers fills.
bool is_view(const std::string& layer) {
  return std::ranges::find(kTracedViews, layer) != kTracedViews.end() ||
         std::ranges::find(kDenoiserViews, layer) != kDenoiserViews.end();
}

/// The layers of an image by name, those of the denoiser's views only if they are filled.
py::dict arrays_of(RenderedImage&& image) {
  const ImageSize size = image.size;
  py::dict all;
  all["ao"] = pixels(std::move(image.ao), size);
  all["ao_raw"] = pixels(std::move(image.ao_raw), size);
  all["depth"] = pixels(std::move(image.depth), size);
  all["coverage"] = pixels(std::move(image.coverage), size);
  all["normal"] = pixels(std::move(image.normal), size);
  all["albedo"] = pixels(std::move(image.albedo), size);
  all["shaded"] = pixels(std::move(image.shaded), size);
  all["instance"] = pixels(std::move(image.instance), size);
  const auto add_view = [&](const char* name, auto& values) {
    if (!values.empty()) all[name] = pixels(std::move(values), size);
  };
  add_view("pbr", image.pbr), add_view("direct", image.direct), add_view("specular", image.specular);
  add_view("hit_distance", image.hit_distance), add_view("motion", image.motion);
  add_view("previous_depth", image.previous_depth), add_view("local_variance", image.local_variance);
  add_view("variance", image.variance), add_view("history", image.history);
  add_view("disocclusion", image.disocclusion);
  return all;
}

/// Keeps the wanted layers.
py::dict chosen_arrays(const py::dict& all, const std::vector<std::string>& layers) {
  py::dict chosen;
  for (const std::string& layer : layers) {
    if (!all.contains(layer)) throw Error(ErrorKind::kUsage, "layers: there is no layer \"" + layer + "\"");
    chosen[layer.c_str()] = all[layer.c_str()];
  }
  return chosen;
}

py::dict render(const std::shared_ptr<BakedFile>& file, std::optional<std::pair<uint32_t, uint32_t>> size,
                std::optional<int64_t> camera_index, uint32_t frames, uint32_t spp, bool denoise,
                const std::string& denoiser, const std::map<std::string, double>& denoiser_settings,
                const std::optional<std::vector<std::string>>& layers, std::optional<float> ao_radius,
                const std::string& ao_resolution, const std::string& ao_rate, const std::string& ao_sampler,
                const std::map<std::string, double>& ao_settings, const std::string& view,
                const std::map<std::string, double>& shade_settings, const std::string& backend, uint64_t seed) {
  RenderedImage image;
  {
    const py::gil_scoped_release release;
    const PackedSource source(*file);
    constexpr ImageSize kDefaultSize{1280, 720};
    const ImageSize wanted = size ? ImageSize{size->first, size->second} : kDefaultSize;
    const Camera camera = chosen_camera(source, camera_index, wanted);
    StillConfig config;
    config.size = size ? wanted : ImageSize{camera.width_px, camera.height_px};
    config.frames = frames;
    config.view_layers = layers && std::ranges::any_of(*layers, is_view);
    set_denoiser(config, {denoise, denoiser, denoiser_settings});
    config.ao.spp = spp;
    config.ao.seed = seed;
    set_ao(config, {ao_radius, ao_resolution, ao_rate, ao_sampler, ao_settings});
    set_shading(config, view, shade_settings);
    config.validate();
    TracerConfig tracing;
    if (!set_backend(tracing, backend))
      throw Error(ErrorKind::kUsage, "backend=\"" + backend + "\": choose one of packed, gpu, gpu-rt, embree");
    FrameLoop loop({&source, file.get(), tracing}, config);
    Progress progress;
    render_still(loop, camera, 0.0, config.frames, false, image, progress);
  }
  const py::dict all = arrays_of(std::move(image));
  return layers ? chosen_arrays(all, *layers) : all;
}

} // namespace

void bind_rendering(py::module_& module) {
  module.def("render", &render, py::arg("file").none(false), py::kw_only(), py::arg("size") = py::none(),
             py::arg("camera") = 0, py::arg("frames") = 32, py::arg("spp") = 1, py::arg("denoise") = true,
             py::arg("denoiser") = "ours", py::arg("denoiser_settings") = std::map<std::string, double>(),
             py::arg("layers") = py::none(), py::arg("ao_radius") = py::none(), py::arg("ao_resolution") = "full",
             py::arg("ao_rate") = "full", py::arg("ao_sampler") = "net",
             py::arg("ao_settings") = std::map<std::string, double>(), py::arg("view") = "ao",
             py::arg("shade_settings") = std::map<std::string, double>(), py::arg("backend") = "packed",
             py::arg("seed") = 0);
}

} // namespace packtrace
