#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/file/baked_file.h"
#include "runtime/ao/ao_integrator.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/source/packed_source.h"
#include "runtime/voxels/proxy_error.h"
#include "runtime/voxels/proxy_tracer.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// 6 x 6 balls of radius 1 that touch a ground, seen from above.
class BallField {
public:
  explicit BallField(VoxelRule rule) : file_(baked(rule)), source_(file_) {
    config_.backend = Backend::kPacked;
    exact_ = make_tracer(source_, &file_, config_);
    std::vector<uint32_t> all(36);
    std::iota(all.begin(), all.end(), 0u);
    voxels_ = std::make_unique<ProxyTracer>(*exact_, file_, source_, all, config_);
    Camera above;
    above.world_from_camera =
        DAffine(DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, -1), DVec3(7.5, 7.5, 30.0) - file_.origin());
    above.fov_degrees = 40.0;
    const PrimaryCamera camera(above, ImageSize{64, 48});
    Progress progress;
    trace_primary(source_, *exact_, camera, camera, seen_, progress);
    ao_.radius = 6.0f;
  }

  double error(bool of_voxels) const {
    return proxy_error(source_, *exact_, of_voxels ? *voxels_ : *exact_, seen_, ao_);
  }

  /// Over all pixels, from other rays.
  double error_of_picture() const {
    AoFrame with, without;
    Progress progress;
    AoConfig ao = ao_;
    ao.spp = 256, ao.seed = 9;
    trace_ao(source_, *voxels_, seen_, ao, 0, with, progress);
    trace_ao(source_, *exact_, seen_, ao, 0, without, progress);
    double sum = 0.0, hits = 0.0;
    for (size_t i = 0; i < seen_.instance.size(); ++i)
      if (seen_.instance[i] != kNoInstance) sum += std::abs(double{with.ao[i]} - double{without.ao[i]}), ++hits;
    return sum / hits;
  }

private:
  static BakedFile baked(VoxelRule rule) {
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes.push_back(test::sphere_mesh(30));
    scene.objects.push_back({"ball", {Shape{0, 0, false, DAffine(1.0)}}});
    for (uint32_t i = 0; i < 36; ++i)
      scene.instances.push_back({0, Affine(test::translation(DVec3(3.0 * (i % 6), 3.0 * (i / 6), 1.0)))});
    test::add_shape(scene, test::grid_mesh(4),
                    compose(test::translation(DVec3(-6, -6, 0)), test::scaling(DVec3(30.0))));
    BakeConfig config;
    config.proxy.use = ProxyUse::kVoxels, config.proxy.voxels = 16, config.proxy.rule = rule;
    return BakedFile::from_bytes(test::bake(scene, config).bytes);
  }

  BakedFile file_;
  PackedSource source_;
  TracerConfig config_;
  std::unique_ptr<RayTracer> exact_, voxels_;
  GBuffer seen_;
  AoConfig ao_;
};

TEST(ProxyError, IsThatOfThePicture) {
  const BallField field(VoxelRule::kConservative);
  EXPECT_EQ(field.error(false), 0.0);
  const double all = field.error_of_picture();
  EXPECT_GT(all, 0.02);
  EXPECT_NEAR(field.error(true), all, 0.15 * all);
}

TEST(ProxyError, MatchedVoxelsHaveAThirdOfIt) {
  const double conservative = BallField(VoxelRule::kConservative).error(true),
               matched = BallField(VoxelRule::kMatched).error(true);
  EXPECT_GT(matched, 0.0);
  EXPECT_LT(3.0 * matched, conservative);
}

} // namespace
} // namespace packtrace
