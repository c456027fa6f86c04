// Rendering to numpy arrays.

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
#include "runtime/frame/still.h"
#include "runtime/python/bindings.h"
#include "runtime/trace/source/packed_source.h"

namespace py = pybind11;

namespace packtrace {
namespace {

/// An array of height x width pixels that takes over the values.
template <typename T>
py::array pixels(std::vector<T>&& values, ImageSize size) {
  using Number = std::conditional_t<std::is_same_v<T, Vec3>, float, T>;
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(size.height), static_cast<py::ssize_t>(size.width)};
  if (std::is_same_v<T, Vec3>) shape.push_back(3);
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

Backend chosen_backend(const std::string& name) {
  if (name == "packed") return Backend::kPacked;
  if (name == "embree") return Backend::kEmbree;
  throw Error(ErrorKind::kUsage, "backend=\"" + name + "\": choose one of packed, embree");
}

py::dict render(const std::shared_ptr<BakedFile>& file, std::optional<std::pair<uint32_t, uint32_t>> size,
                std::optional<int64_t> camera_index, uint32_t frames, uint32_t spp, bool denoise,
                std::optional<float> ao_radius, const std::string& backend, uint64_t seed) {
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
    config.denoise = denoise;
    config.ao.spp = spp;
    config.ao.seed = seed;
    config.ao.radius = ao_radius.value_or(default_ao_radius(source.world_bounds()));
    config.validate();
    TracerConfig tracing;
    tracing.backend = chosen_backend(backend);
    FrameLoop loop({&source, file.get(), tracing}, config);
    Progress progress;
    render_still(loop, camera, 0.0, config.frames, false, image, progress);
  }
  const ImageSize shape = image.size;
  py::dict result;
  result["ao"] = pixels(std::move(image.ao), shape);
  result["ao_raw"] = pixels(std::move(image.ao_raw), shape);
  result["depth"] = pixels(std::move(image.depth), shape);
  result["coverage"] = pixels(std::move(image.coverage), shape);
  result["normal"] = pixels(std::move(image.normal), shape);
  result["albedo"] = pixels(std::move(image.albedo), shape);
  result["shaded"] = pixels(std::move(image.shaded), shape);
  result["instance"] = pixels(std::move(image.instance), shape);
  return result;
}

} // namespace

void bind_rendering(py::module_& module) {
  module.def("render", &render, py::arg("file").none(false), py::kw_only(), py::arg("size") = py::none(),
             py::arg("camera") = 0, py::arg("frames") = 32, py::arg("spp") = 1, py::arg("denoise") = true,
             py::arg("ao_radius") = py::none(), py::arg("backend") = "packed", py::arg("seed") = 0);
}

} // namespace packtrace
