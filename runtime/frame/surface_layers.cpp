#include "runtime/frame/surface_layers.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// Calls work(out, in) for each pixel `out` of the image and each of its sub-pixels `in`, until it returns false.
template <typename Work>
void for_each_sub_pixel(const FrameConfig& config, const Work& work) {
  constexpr uint32_t kRows = 8;
  const uint32_t factor = config.supersample, width = config.size.width;
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, config.size.height, kRows),
                    [&](const tbb::blocked_range<uint32_t>& rows) {
                      for (uint32_t y = rows.begin(); y < rows.end(); ++y)
                        for (uint32_t x = 0; x < width; ++x)
                          for (uint32_t sub = 0; sub < factor * factor; ++sub)
                            if (!work(size_t{y} * width + x, (size_t{y} * factor + sub / factor) * width * factor +
                                                                 size_t{x} * factor + sub % factor))
                              break;
                    });
}

} // namespace

void write_surface_layers(const FrameConfig& config, const GBuffer& gbuffer, const SceneSource& source,
                          const SceneSource& traced, RenderedImage& image) {
  image.material_flags.assign(image.size.pixels(), 0), image.cluster.assign(image.size.pixels(), 0);
  for_each_sub_pixel(config, [&](size_t out, size_t in) {
    if (gbuffer.instance[in] == kNoInstance) return true;
    image.material_flags[out] = source.materials()[gbuffer.material[in]].flags;
    image.cluster[out] = traced.detail_of(gbuffer.instance[in], gbuffer.triangle[in]).cluster;
    return false;
  });
}

void write_cost_layers(const FrameConfig& config, const RayCosts& costs, RenderedImage& image) {
  for (std::vector<float>* layer : {&image.visited_nodes, &image.visited_leaves, &image.tested_triangles})
    layer->assign(image.size.pixels(), 0.0f);
  const float scale = 1.0f / static_cast<float>(config.supersample * config.supersample);
  for_each_sub_pixel(config, [&](size_t out, size_t in) {
    image.visited_nodes[out] += scale * static_cast<float>(costs.nodes[in]);
    image.visited_leaves[out] += scale * static_cast<float>(costs.leaves[in]);
    image.tested_triangles[out] += scale * static_cast<float>(costs.triangles[in]);
    return true;
  });
}

} // namespace packtrace
