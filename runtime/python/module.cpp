// Python module packtrace._packtrace; packtrace/__init__.pyi describes it. Long calls release the GIL.

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/separate_motion.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/python/bindings.h"

namespace py = pybind11;

namespace packtrace {
namespace {

constexpr std::array<const char*, 6> kErrorKinds{"usage", "input", "unsupported", "limit_exceeded", "io", "cancelled"};
constexpr std::array<const char*, 3> kLodUses{"off", "instanced", "all"}; // by LodUse
constexpr std::array<const char*, baked::kPurposeCount> kPurposes{"ao", "shading"};

/// Defines packtrace.Error and raises it for every Error.
void bind_errors(py::module_& module) {
  static py::exception<Error> type(module, "Error", PyExc_RuntimeError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      py::object raised = static_cast<py::object&>(type)(error.what());
      const auto kind = static_cast<size_t>(error.exit_code() - static_cast<int>(ErrorKind::kUsage));
      raised.attr("kind") = kErrorKinds.at(kind);
      raised.attr("exit_code") = error.exit_code();
      PyErr_SetObject(type.ptr(), raised.ptr());
    }
  });
}

/// Returns the place of a name in a list. Throws Error(kUsage) if it is not there.
template <size_t N>
size_t choice(const char* option, const std::array<const char*, N>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<size_t>(found - names.begin());
  std::string known;
  for (const char* each : names) known += (known.empty() ? "" : ", ") + std::string(each);
  throw Error(ErrorKind::kUsage, std::string(option) + "=\"" + name + "\": choose one of " + known);
}

struct Precision {
  std::optional<double> edge, absolute;
  std::optional<uint32_t> bits;
};

void set_precision(BakeConfig& config, const Precision& precision) {
  if ((precision.edge ? 1 : 0) + (precision.absolute ? 1 : 0) + (precision.bits ? 1 : 0) > 1)
    throw Error(ErrorKind::kUsage, "give one of precision_edge, precision_abs and position_bits");
  const auto set = [&](PrecisionKind kind, double value) { config.precision_kind = kind, config.precision = value; };
  if (precision.edge) set(PrecisionKind::kEdgeFraction, *precision.edge);
  if (precision.absolute) set(PrecisionKind::kAbsolute, *precision.absolute);
  if (precision.bits) set(PrecisionKind::kPositionBits, static_cast<double>(*precision.bits));
}

py::object bake(const std::filesystem::path& scene, const std::filesystem::path& output, const std::string& purpose,
                std::optional<double> precision_edge, std::optional<double> precision_abs,
                std::optional<uint32_t> position_bits, const std::string& normals, bool keep_normals, bool keep_uvs,
                const std::string& codec, const std::string& lod, bool strict, bool force) {
  std::string report;
  std::vector<std::string> problems;
  {
    const py::gil_scoped_release release;
    BakeConfig config;
    config.purpose = static_cast<baked::Purpose>(choice("purpose", kPurposes, purpose));
    set_precision(config, {precision_edge, precision_abs, position_bits});
    config.normals = find_normal_encoding(normals);
    if (!config.normals && normals != "auto")
      throw Error(ErrorKind::kUsage, "normals=\"" + normals + "\": no such encoding");
    config.keep_normals = keep_normals;
    config.keep_uvs = keep_uvs;
    const std::optional<PageCodec> found = find_page_codec(codec);
    if (!found) throw Error(ErrorKind::kUsage, "codec=\"" + codec + "\": choose one of none, fast, small");
    config.choose_codec(*found);
    config.lod = static_cast<LodUse>(choice("lod", kLodUses, lod));
    config.textures = config.purpose == baked::kShading;
    config.strict = strict;
    config.validate();

    Diagnostics diagnostics;
    Progress progress;
    ImportOptions options;
    options.strict = strict;
    options.keep_textures = config.textures;
    options.keep_shading = config.purpose == baked::kShading;
    options.memory = config.memory;
    ImportResult imported = import_scene(scene, options, diagnostics, progress);
    separate_motion(imported.scene);
    const BakeReport baked = bake_scene(imported.scene, config, output, force, diagnostics, progress);
    report = to_json(baked.file, false).dump();
    for (const Diagnostic& problem : diagnostics.entries()) problems.push_back(to_string(problem));
  }
  py::object result = py::module_::import("json").attr("loads")(report);
  result["problems"] = problems;
  return result;
}

} // namespace
} // namespace packtrace

PYBIND11_MODULE(_packtrace, module) {
  using namespace packtrace;
  module.attr("__version__") = PACKTRACE_VERSION;
  bind_errors(module);
  bind_files(module);
  bind_rendering(module);
  module.def("bake", &bake, py::arg("scene"), py::arg("output"), py::kw_only(), py::arg("purpose") = "ao",
             py::arg("precision_edge") = py::none(), py::arg("precision_abs") = py::none(),
             py::arg("position_bits") = py::none(), py::arg("normals") = "auto", py::arg("keep_normals") = false,
             py::arg("keep_uvs") = false, py::arg("codec") = "none", py::arg("lod") = "off", py::arg("strict") = false,
             py::arg("force") = false);
}
