#include "runtime/commands/reports/seam_report.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "runtime/commands/reports/file_report.h"

namespace packtrace {
namespace {

constexpr double kVisiblePx = 0.5;

/// Smallest camera-space depth per instance over all pixels, world units; infinite for instances that no pixel shows.
std::vector<double> nearest_depths(const RenderedImage& image, size_t instances) {
  std::vector<double> nearest(instances, std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < image.instance.size(); ++i)
    if (const uint32_t instance = image.instance[i]; instance != kNoInstance && image.depth[i] > 0.0f)
      nearest[instance] = std::min(nearest[instance], double{image.depth[i]});
  return nearest;
}

/// Error bound per instance: distance of the traced LOD cut from level 0, world units.
std::vector<double> instance_errors(const DetailPlanner& detail) {
  const LodSource& source = detail.source();
  std::vector<double> of_blas(source.geometry_count());
  for (uint32_t blas = 0; blas < of_blas.size(); ++blas)
    for (const BlasCluster& cluster : source.clusters(blas))
      of_blas[blas] = std::max(of_blas[blas], double{cluster.error});
  std::vector<double> errors;
  for (const PlacedGeometry& instance : source.instances())
    errors.push_back(of_blas[instance.geometry] * largest_stretch(DAffine(instance.world_from_object)));
  return errors;
}

/// Screen-space error bound of the LOD cuts in pixels; infinite if the options give no bound.
double lod_error_bound_px(const DetailPlanner& detail) {
  const SharingConfig& config = detail.sharing().config();
  if (config.tolerant_levels > 0) return std::numeric_limits<double>::infinity();
  return detail.error_px() * std::max(1.0, config.culled_error_scale);
}

} // namespace

nlohmann::json seams_json(const SeamSummary& seams) {
  return {{"instances", seams.instances}, {"touching", seams.touching}, {"largest_gap", seams.largest_gap}};
}

std::string seams_text(const SeamSummary& seams) {
  if (seams.touching == 0) return {};
  return fmt::format(grouped(),
                     "{:L} of {:L} instances with their own grid touch other geometry: seams may open by up to {:.3g} "
                     "world units (half a step of each of the two grids), and by the errors of coarser LOD levels\n",
                     seams.touching, seams.instances, seams.largest_gap);
}

nlohmann::json visible_seams_json(const InstanceSeams& seams, const RenderedImage& image, const PrimaryCamera& camera,
                                  const DetailPlanner* detail) {
  const std::vector<double> nearest = nearest_depths(image, seams.instance_count());
  const bool orthographic = camera.projection() == Projection::kOrthographic;
  std::vector<double> errors(nearest.size()), beside(seams.touching().size());
  double promised = 0.0;
  if (detail)
    errors = instance_errors(*detail), beside = seams.largest_touching(errors), promised = lod_error_bound_px(*detail);
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
      "  seams     may open by up to {:.2g} px where instances touch other geometry (grids {:.2g}, LOD {:.2g}); "
      "more than half a pixel at {:L} of {:L} visible instances\n",
      seams.at("largest_px").get<double>(), seams.at("of_grids_px").get<double>(),
      seams.at("of_detail_px").get<double>(), seams.at("above_half_a_pixel").get<uint64_t>(),
      seams.at("visible").get<uint64_t>());
}

} // namespace packtrace
