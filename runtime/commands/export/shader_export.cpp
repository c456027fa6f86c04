#include "runtime/commands/export/shader_export.h"

#include <algorithm>

#include <fmt/format.h>

#include "compress/bake/proxies/build_proxies.h"
#include "compress/exchange/shader/voxel_shader.h"
#include "compress/format/voxels/proxy_section.h"
#include "pbrt_import/base/file_error.h"
#include "runtime/commands/cli/loaded_scene.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/cli/whole_number.h"
#include "runtime/commands/export/image_export.h"
#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

constexpr const char *kShadertoyName = "shadertoy", *kGlsl450Name = "glsl450";

/// Number of the geometry that the options name.
uint32_t find_geometry(const BakedFile& file, const std::string& input, const std::optional<std::string>& wanted,
                       const std::vector<Proxy>& stored) {
  const uint32_t count = file.base_geometry_count();
  if (!wanted) {
    if (stored.size() == 1) return stored.front().record.geometry;
    if (count == 1) return 0;
    std::string names;
    for (uint32_t g = 0; g < std::min(count, 8u); ++g)
      names += fmt::format("{}{} ({})", g > 0 ? ", " : "", g, file.text(file.geometries()[g].name));
    throw FileError(
        ErrorKind::kUsage, input,
        fmt::format("it has {} geometries; choose one with --geometry: {}{}", count, names, count > 8 ? ", ..." : ""));
  }
  for (uint32_t g = 0; g < count; ++g)
    if (file.text(file.geometries()[g].name) == *wanted) return g;
  if (const auto number = whole_number(*wanted); number && *number < count) return *number;
  throw FileError(ErrorKind::kUsage, input, "it has no geometry " + *wanted);
}

class ShaderMaker {
public:
  ShaderMaker(const BakedFile& file, const std::string& input, const ShaderOptions& options, const MemoryBudget& budget,
              Progress& progress)
      : file_(file), input_(input), budget_(budget), progress_(progress) {
    if (options.proxy.proxy == "off")
      throw Error(ErrorKind::kUsage, "--proxy off has no effect on shaders, which hold voxels");
    if (const std::span<const uint8_t> bytes = proxy_bytes(file); !bytes.empty()) stored_ = read_proxies(bytes);
    geometry_ = find_geometry(file, input, options.geometry, stored_);
    ProxyOptions proxy = options.proxy;
    if (proxy.proxy == "sdf") throw Error(ErrorKind::kUsage, "shaders hold voxels: use --proxy voxels");
    proxy.proxy = "voxels";
    config_ = make_proxy_config(proxy);
    build_ = options.proxy.voxels || options.proxy.rule || options.proxy.fill || options.proxy.dag ||
             options.proxy.materials;
    limit_ = options.config().max_elements;
  }

  Proxy run() const {
    const auto found = std::ranges::find(stored_, geometry_, [](const Proxy& p) { return p.record.geometry; });
    const bool stored = !build_ && found != stored_.end() && !found->is_field();
    Proxy proxy = stored ? *found : build(config_.voxels);
    if (shader_elements(proxy) <= limit_) return proxy;
    const VoxelIndex& size = proxy.voxels.size();
    const uint32_t largest = largest_that_fits(std::max({size[0], size[1], size[2]}));
    throw FileError(ErrorKind::kLimitExceeded, input_,
                    fmt::format("{} x {} x {} voxels take {} array elements, of {} (--max-elements); {}", size[0],
                                size[1], size[2], shader_elements(proxy), limit_,
                                largest > 0 ? fmt::format("the largest that fits is --proxy-voxels {}", largest)
                                            : std::string("not even one voxel fits")));
  }

private:
  Proxy build(uint32_t voxels) const {
    ProxyConfig config = config_;
    config.voxels = voxels;
    std::optional<Proxy> proxy = build_proxy(file_, geometry_, config, budget_);
    if (!proxy)
      throw FileError(ErrorKind::kUnsupported, input_,
                      "geometry " + std::string(file_.text(file_.geometries()[geometry_].name)) +
                          " has nothing that occludes");
    progress_.check_cancelled();
    return std::move(*proxy);
  }

  /// Elements grow with the grid, but not with every step: the last steps are tried one by one.
  uint32_t largest_that_fits(uint32_t too_many) const {
    const auto fits = [&](uint32_t voxels) { return shader_elements(build(voxels)) <= limit_; };
    uint32_t low = 0, high = too_many;
    while (high - low > 1) {
      const uint32_t middle = low + (high - low) / 2;
      (fits(middle) ? low : high) = middle;
    }
    for (uint32_t next = std::min(low + 4, too_many - 1); next > low; --next)
      if (fits(next)) return next;
    return low;
  }

  const BakedFile& file_;
  const std::string& input_;
  const MemoryBudget& budget_;
  Progress& progress_;
  std::vector<Proxy> stored_;
  uint32_t geometry_ = 0, limit_ = 0;
  ProxyConfig config_;
  bool build_ = false;
};

} // namespace

void add_shader_options(CLI::App& verb, ShaderOptions& options) {
  constexpr const char* kGroup = "Shaders (.glsl)";
  verb.add_option("--geometry", options.geometry, "Geometry of the shader: its name or number (default: the only one)")
      ->type_name("NAME|I")
      ->group(kGroup);
  verb.add_option(
          "--shader", options.form,
          "shadertoy: GLSL ES 3.00 with Shadertoy's conventions; glsl450: a fragment shader for Vulkan, with the "
          "resolution as push constant (default shadertoy)")
      ->check(one_of({kShadertoyName, kGlsl450Name}))
      ->group(kGroup);
  verb.add_option(
          "--max-elements", options.max_elements,
          "Most elements of all constant arrays together, a vec3 counts as one (default 4096; 1024 for wide support). "
          "More is refused with the largest grid that fits")
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--up", options.up, "Axis of the geometry that points up in the picture (default y)")
      ->check(one_of({"x", "y", "z"}))
      ->group(kGroup);
  add_image_options(verb, options, kGroup);
  add_proxy_options(verb, options.proxy);
}

std::vector<std::string> ShaderOptions::voxel_names() const {
  std::vector<std::string> names = proxy.names();
  if (geometry) names.push_back("--geometry");
  if (up) names.push_back("--up");
  return names;
}

std::vector<std::string> ShaderOptions::image_names() const {
  std::vector<std::string> names;
  if (texture) names.push_back("--texture");
  if (image_format) names.push_back("--image-format");
  if (image_size) names.push_back("--image-size");
  return names;
}

std::vector<std::string> ShaderOptions::names() const {
  std::vector<std::string> names = voxel_names();
  for (std::string& name : image_names()) names.push_back(std::move(name));
  if (form) names.push_back("--shader");
  if (max_elements) names.push_back("--max-elements");
  return names;
}

ShaderConfig ShaderOptions::config() const {
  ShaderConfig result;
  result.form = form == kGlsl450Name ? ShaderForm::kGlsl450 : ShaderForm::kShadertoy;
  result.max_elements = max_elements.value_or(kMaxShaderElements);
  if (result.max_elements == 0) throw Error(ErrorKind::kUsage, "--max-elements must be at least 1");
  return result;
}

ShaderExport export_shader(const std::string& input, const std::string& output, const ShaderOptions& options,
                           const MemoryBudget& budget, Progress& progress) {
  if (options.texture || !is_baked_file(input)) return export_image(input, output, options, budget, progress);
  refuse_without_effect(options.image_names(), "voxels; add --texture for a texture of the file");
  const MemoryReservation memory = reserve_decoded(input, budget);
  const BakedFile file = BakedFile::open(input);
  const ShaderMaker maker(file, input, options, budget, progress);
  const Proxy proxy = maker.run();
  const ShaderConfig config = options.config();
  const VoxelIndex& size = proxy.voxels.size();
  const std::string text = voxel_shader(proxy, shader_view(size, options.up.value_or("y")[0] - 'x'), config);
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  const uint64_t elements = shader_elements(proxy);
  return {std::vector<std::byte>(first, first + text.size()),
          {{"verb", "export"},
           {"input", input},
           {"output", output},
           {"layout", "glsl"},
           {"shader", options.form.value_or(kShadertoyName)},
           {"geometry", file.text(file.geometries()[proxy.record.geometry].name)},
           {"size", size},
           {"elements", elements},
           {"max_elements", config.max_elements},
           {"bits", proxy.voxels.bits()},
           {"surface_error", proxy.record.surface_error},
           {"voxel_error", proxy.record.voxel_error},
           {"bytes", text.size()},
           {"peak_rss_bytes", peak_rss_bytes()}},
          fmt::format(grouped(), "{}: {} x {} x {} voxels in {:L} of {:L} array elements, {:L} bytes of text\n", output,
                      size[0], size[1], size[2], elements, config.max_elements, text.size()),
          {}};
}

} // namespace packtrace
