#include "runtime/frame/surface_layers.h"

#include <map>
#include <memory>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/frame/frame_loop.h"
#include "runtime/frame/still.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

/// A floor and an emissive ball, baked, in the lower half of the picture.
class SurfaceBench {
public:
  SurfaceBench() {
    Scene scene;
    test::add_shape(scene, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
    test::add_shape(scene, test::sphere(Vec3(0, 1, 0), 1.0f, 24), kEmissive);
    baked_ = std::make_unique<test::BakedScene>(scene);
  }

  /// The image of a frame at 64 x 48.
  RenderedImage image(Backend backend, uint32_t supersample = 1) const {
    FrameConfig config;
    config.size = {64, 48};
    config.supersample = supersample;
    config.ao.radius = 1.0f;
    config.surface_layers = true;
    config.cost_layers = backend == Backend::kPacked;
    FrameScene scene{&baked_->source, &baked_->file, {}, nullptr, false};
    scene.backend.backend = backend;
    FrameLoop loop(scene, config);
    RenderedImage result;
    Progress progress;
    render_picture(loop, test::camera_at(DVec3(0, 3, -7), DVec3(0, 2, 0), 60.0), 0.0, 1, result, progress);
    return result;
  }
  const BakedFile& file() const { return baked_->file; }

private:
  std::unique_ptr<test::BakedScene> baked_;
};

TEST(SurfaceLayers, TellMaterialFlagsAndClusters) {
  const SurfaceBench bench;
  const RenderedImage image = bench.image(Backend::kEmbree);
  std::set<uint32_t> flags, clusters;
  std::map<uint32_t, uint32_t> flags_of; // by instance
  for (size_t i = 0; i < image.size.pixels(); ++i) {
    if (image.coverage[i] == 0.0f) {
      EXPECT_EQ(image.material_flags[i], 0u);
      EXPECT_EQ(image.cluster[i], 0u);
      continue;
    }
    flags.insert(image.material_flags[i]), clusters.insert(image.cluster[i]);
    EXPECT_EQ(flags_of.emplace(image.instance[i], image.material_flags[i]).first->second, image.material_flags[i]);
  }
  EXPECT_EQ(flags, (std::set<uint32_t>{0, kEmissive}));
  EXPECT_GT(clusters.size(), 3u) << "the ball has several";
  EXPECT_LT(*clusters.rbegin(), bench.file().sections().clusters.size());
  EXPECT_TRUE(image.visited_nodes.empty());
}

TEST(SurfaceLayers, CostsAreThoseOfRaysTracedAlone) {
  const SurfaceBench bench;
  const RenderedImage image = bench.image(Backend::kPacked);
  size_t sky = 0, seen = 0;
  for (size_t i = 0; i < image.size.pixels(); ++i) {
    if (image.coverage[i] == 0.0f) {
      sky += image.tested_triangles[i] == 0.0f ? 1 : 0;
      continue;
    }
    ++seen;
    EXPECT_GE(image.visited_nodes[i], 1.0f);
    EXPECT_GE(image.visited_leaves[i], 1.0f);
    EXPECT_GE(image.tested_triangles[i], 1.0f);
  }
  EXPECT_GT(seen, 500u);
  EXPECT_GT(sky, 100u) << "far from the surfaces no triangle is tested";
  const RenderedImage fine = bench.image(Backend::kPacked, 2);
  const auto mean = [](const std::vector<float>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / 3072.0; };
  EXPECT_NEAR(mean(fine.visited_nodes) / mean(image.visited_nodes), 1.0, 0.05) << "means, not sums";
}

TEST(SurfaceLayers, CostsRequireThePackedTracer) {
  const SurfaceBench bench;
  FrameConfig config;
  config.size = {8, 8};
  config.cost_layers = true;
  Scene scene;
  test::add_shape(scene, test::quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
  const FloatSource source(scene);
  FrameLoop loop(FrameScene{&source, nullptr, {}}, config);
  RenderedImage image;
  Progress progress;
  EXPECT_THROW(render_picture(loop, test::camera_at(DVec3(0, 3, -7), DVec3(0)), 0.0, 1, image, progress), Error);
}

} // namespace
} // namespace packtrace
