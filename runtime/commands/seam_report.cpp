#include "runtime/commands/seam_report.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/file_report.h"

namespace packtrace {
namespace {

constexpr double kVisiblePx = 0.5;

/// By instance: how near pixels show it, camera-space depth; infinite where none does.
std::vector<double> nearest_depths(const RenderedImage& image, size_t instances) {
  std::vector<double> nearest(instances, std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < image.instance.size(); ++i)
    if (const uint32_t instance = image.instance[i]; instance != kNoInstance && image.depth[i] > 0.0f)
      nearest[instance] = std::min(nearest[instance], double{image.depth[i]});
  return nearest;
}

/// By instance: how far what is traced of it lies from level 0, world units.
std::vector<double> stated_errors(const ChosenDetail& detail) {
  const LodSource& source = *detail.source;
  std::vector<double> of_blas(source.geometry_count());
  for (uint32_t blas = 0; blas < of_blas.size(); ++blas)
    for (const BlasCluster& cluster : source.clusters(blas))
      of_blas[blas] = std::max(of_blas[blas], double{cluster.error});
  std::vector<double> errors;
  for (const PlacedGeometry& instance : source.instances())
    errors.push_back(of_blas[instance.geometry] * largest_stretch(DAffine(instance.world_from_object)));
  return errors;
}

/// What the choice of detail promises, in pixels; infinite where it promises nothing.
double promised_px(const ChosenDetail& detail) {
  const SharingConfig& config = detail.sharing->config();
  if (config.tolerant_levels > 0) return std::numeric_limits<double>::infinity();
  return detail.error_px * std::max(1.0, config.culled_error_scale);
}

} // namespace

nlohmann::json seams_json(const SeamSummary& seams) {
  return {{"instances", seams.instances}, {"touching", seams.touching}, {"largest_gap", seams.largest_gap}};
}

std::string seams_text(const SeamSummary& seams) {
  if (seams.touching == 0) return {};
  return fmt::format(grouped(),
                     "{:L} of {:L} instances on grids of their own touch other geometry: seams gape by {:.3g} world "
                     "units at most, half a step of both grids, and by the errors of coarser levels\n",
                     seams.touching, seams.instances, seams.largest_gap);
}

nlohmann::json visible_seams_json(const InstanceSeams& seams, const RenderedImage& image, const PrimaryCamera& camera,
                                  const ChosenDetail* detail) {
  const std::vector<double> nearest = nearest_depths(image, seams.instance_count());
  const bool orthographic = camera.projection() == Projection::kOrthographic;
  std::vector<double> errors(nearest.size()), beside(seams.touching().size());
  double promised = 0.0;
  if (detail) errors = stated_errors(*detail), beside = seams.largest_touching(errors), promised = promised_px(*detail);
  uint64_t visible = 0, wide = 0;
  double grids_px = 0.0, detail_px = 0.0, largest_px = 0.0;
  for (size_t i = 0; i < seams.touching().size(); ++i) {
    const uint32_t instance = seams.touching()[i];
    if (nearest[instance] == std::numeric_limits<double>::infinity()) continue;
    const double pixel = camera.pixel_spread() * (orthographic ? 1.0 : nearest[instance]);
    const double of_grids = seams.gaps()[i] / pixel;
    const double of_detail = std::min(errors[instance] / pixel, promised) + std::min(beside[i] / pixel, promised);
    ++visible, wide += of_grids + of_detail > kVisiblePx;
    grids_px = std::max(grids_px, of_grids), detail_px = std::max(detail_px, of_detail);
    largest_px = std::max(largest_px, of_grids + of_detail);
  }
  return {{"visible", visible},
          {"above_half_a_pixel", wide},
          {"largest_px", largest_px},
          {"of_grids_px", grids_px},
          {"of_detail_px", detail_px}};
}

std::string visible_seams_text(const nlohmann::json& seams) {
  if (seams.at("above_half_a_pixel") == 0) return {};
  return fmt::format(
      grouped(),
      "  seams     may gape by {:.2g} px where instances touch other geometry (grids {:.2g}, detail {:.2g}); "
      "by more than half a pixel at {:L} of {:L} instances\n",
      seams.at("largest_px").get<double>(), seams.at("of_grids_px").get<double>(),
      seams.at("of_detail_px").get<double>(), seams.at("above_half_a_pixel").get<uint64_t>(),
      seams.at("visible").get<uint64_t>());
}

} // namespace packtrace
