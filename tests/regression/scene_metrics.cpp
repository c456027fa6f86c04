#include "tests/regression/scene_metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/pages/page_encoder.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/ao/half_resolution.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "runtime/trace/source/float_source.h"
#include "runtime/trace/source/packed_source.h"
#include "tests/runtime/trace/embree_cluster_tracer.h"

namespace packtrace::test {
namespace {

struct Picture {
  GBuffer surfaces;
  AoFrame ao;
};

bool sees_nothing(const Picture& picture) {
  return std::ranges::all_of(picture.surfaces.instance, [](uint32_t instance) { return instance == kNoInstance; });
}

/// Renders sources with one camera and one set of occlusion rays.
class View {
public:
  /// @param framed use a camera that frames the whole scene instead of the scene's own
  View(const SceneSource& source, const PictureSettings& settings, bool framed)
      : camera_(camera_of(source, size_of(settings), framed), size_of(settings)) {
    ao_.radius = ao_radius({}, source.world_bounds());
    ao_.spp = static_cast<uint32_t>(settings.spp);
  }

  Picture of(const SceneSource& source, const RayTracer& tracer) const {
    Picture picture;
    Progress progress;
    trace_primary(source, tracer, camera_, camera_, picture.surfaces, progress);
    trace_ao(source, tracer, picture.surfaces, ao_, 0, picture.ao, progress);
    return picture;
  }

private:
  static ImageSize size_of(const PictureSettings& settings) {
    return {static_cast<uint32_t>(settings.width), static_cast<uint32_t>(settings.height)};
  }
  static Camera camera_of(const SceneSource& source, ImageSize size, bool framed) {
    return framed || source.cameras().empty() ? framing_camera(source.world_bounds(), size, source.cameras())
                                              : source.cameras()[0];
  }

  PrimaryCamera camera_;
  AoConfig ao_;
};

/// Raises a metric to a value, so that it keeps the worst of several pictures.
void raise(Metrics& metrics, const std::string& name, double value) {
  double& worst = metrics.try_emplace(name, 0.0).first->second;
  worst = std::max(worst, value);
}

/// Adds mean, root mean square and 99th percentile of AO differences.
void add_ao_differences(Metrics& metrics, const std::string& prefix, std::vector<double> ao) {
  double sum = 0.0, squares = 0.0, p99 = 0.0;
  for (const double error : ao) sum += error, squares += error * error;
  const double count = std::max<double>(static_cast<double>(ao.size()), 1.0);
  if (!ao.empty()) {
    const auto nth = ao.begin() + static_cast<std::ptrdiff_t>((ao.size() - 1) * 99 / 100);
    std::nth_element(ao.begin(), nth, ao.end());
    p99 = *nth;
  }
  raise(metrics, prefix + "ao_mae", sum / count);
  raise(metrics, prefix + "ao_rmse", std::sqrt(squares / count));
  raise(metrics, prefix + "ao_p99", p99);
}

/// Adds the error of upsampling the AO of one of 2 x 2 pixels, against that of all pixels.
void add_quarter_resolution(Metrics& metrics, const Picture& picture) {
  const HalfGBuffer half = halve(picture.surfaces);
  std::vector<float> quarter;
  for (const uint32_t pixel : half.pixel) quarter.push_back(picture.ao.ao[pixel]);
  const std::vector<float> upsampled = upsample_ao<1>(picture.surfaces, half, {quarter})[0];
  std::vector<double> errors;
  for (size_t i = 0; i < upsampled.size(); ++i)
    if (picture.surfaces.instance[i] != kNoInstance)
      errors.push_back(std::abs(double{upsampled[i]} - double{picture.ao.ao[i]}));
  add_ao_differences(metrics, "quarter_", std::move(errors));
}

/// Adds the differences between two pictures: shares of all pixels that hit something in one picture only (hits) or
/// whose depths differ (depth), and mean, root mean square and 99th percentile of |AO difference| over the others.
void add_differences(Metrics& metrics, const std::string& prefix, const Picture& a, const Picture& b,
                     double depth_tolerance) {
  const size_t pixels = a.surfaces.instance.size();
  size_t hits = 0, depth = 0;
  std::vector<double> ao;
  for (size_t i = 0; i < pixels; ++i) {
    const bool in_a = a.surfaces.instance[i] != kNoInstance, in_b = b.surfaces.instance[i] != kNoInstance;
    hits += in_a != in_b;
    if (!in_a || !in_b) continue;
    const double z = double{b.surfaces.view_z[i]};
    if (std::abs(double{a.surfaces.view_z[i]} - z) <= depth_tolerance * z)
      ao.push_back(std::abs(double{a.ao.ao[i]} - double{b.ao.ao[i]}));
    else
      ++depth;
  }
  raise(metrics, prefix + "hits", static_cast<double>(hits) / static_cast<double>(pixels));
  raise(metrics, prefix + "depth", static_cast<double>(depth) / static_cast<double>(pixels));
  add_ao_differences(metrics, prefix, std::move(ao));
}

void add_pictures(Metrics& metrics, const Scene& scene, const BakedFile& file, const PictureSettings& settings) {
  const FloatSource float_source(scene);
  const EmbreeTracer float_tracer(float_source, {});
  View view(float_source, settings, false);
  Picture floats = view.of(float_source, float_tracer);
  if (sees_nothing(floats)) {
    view = View(float_source, settings, true);
    floats = view.of(float_source, float_tracer);
  }
  add_quarter_resolution(metrics, floats);
  const PackedSource source(file);
  const Picture embree = view.of(source, EmbreeTracer(source, {}));
  const auto add = [&](const Picture& picture) {
    add_differences(metrics, "floats_", picture, floats, settings.depth_tolerance);
    add_differences(metrics, "embree_", picture, embree, settings.depth_tolerance);
  };
  add(embree);
  for (const PackedIsa isa : {PackedIsa::kScalar, PackedIsa::kAvx2, PackedIsa::kAvx512})
    if (isa_supported(isa)) add(view.of(source, PackedTracer(file, source, isa)));
  add(view.of(source, EmbreeClusterTracer(file, source)));
}

} // namespace

Metrics measure_scene(const std::filesystem::path& scene_file, const PictureSettings& settings, bool with_sizes) {
  Diagnostics diagnostics;
  Progress progress;
  const Scene scene = import_scene(scene_file, {}, diagnostics, progress).scene;
  Metrics metrics;
  metrics["errors"] = static_cast<double>(diagnostics.count(Severity::kError));
  const BakedScene baked = bake_to_bytes(scene, {}, diagnostics, progress);
  const BakeReport& report = baked.report;
  // Every triangle is either stored or counted as left out.
  metrics["triangles"] =
      static_cast<double>(report.file.triangles + report.collapsed_triangles + report.coinciding_triangles);
  metrics["bytes"] = static_cast<double>(baked.bytes.size());
  metrics["position_error"] = report.max_position_error;
  metrics["normal_error_degrees"] = report.max_normal_error_degrees;
  metrics["normal_error_mean_degrees"] = report.mean_normal_error_degrees;
  const BakedFile file = BakedFile::borrow_bytes(baked.bytes, "bake result");
  if (with_sizes) {
    const auto bytes_of = [&](PageCodec codec) {
      BakeConfig config;
      config.choose_codec(codec);
      return static_cast<double>(bake_to_bytes(scene, config, diagnostics, progress).bytes.size());
    };
    metrics["bytes_fast"] = bytes_of(PageCodec::kFast);
    metrics["bytes_small"] = bytes_of(PageCodec::kSmall);
  }
  add_pictures(metrics, scene, file, settings);
  return metrics;
}

} // namespace packtrace::test
