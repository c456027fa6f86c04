#include "tests/regression/denoised_scene.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/world_view.h"
#include "runtime/frame/camera_path.h"
#include "runtime/frame/still.h"
#include "runtime/image/metrics.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace::test {
namespace {

constexpr uint32_t kTruthSamplesPerFrame = 64;

/// Bakes a scene with a box that is out of sight and too small to occlude: behind the eye.
BakedFile bake_with_box(const std::filesystem::path& scene_file) {
  Diagnostics diagnostics;
  Progress progress;
  Scene scene = import_scene(scene_file, {}, diagnostics, progress).scene;
  const DAffine& camera = scene.cameras.at(0).world_from_camera;
  const DVec3 forward = glm::normalize(DVec3(camera[2]));
  Instance box;
  box.object = add_object(scene, test::box(Vec3(-0.5f), Vec3(0.5f)));
  box.world_from_object = Affine(placed(DVec3(camera[3]) - 1e-3 * forward, DVec3(1e-4)));
  scene.instances.push_back(box);
  return BakedFile::from_bytes(bake_to_bytes(scene, {}, diagnostics, progress).bytes);
}

} // namespace

DenoisedScene::DenoisedScene(const std::filesystem::path& scene_file, ImageSize size)
    : size_(size), file_(bake_with_box(scene_file)), source_(std::make_unique<PackedSource>(file_)),
      camera_(source_->cameras().front()), scene_{source_.get(), &file_, {}},
      up_(estimate_world_view(source_->cameras()).up), radius_(ao_radius({}, source_->world_bounds())) {
  scene_.backend.backend = Backend::kPacked; // needs no trees of its own, and there are many loops
  place_box();
}

/// Moves the box past the surface in the middle of the view: a fifth of the image's height large, by about a pixel a
/// frame.
void DenoisedScene::place_box() {
  FrameLoop probe(scene_, config());
  next_picture(probe, camera_);
  const GBuffer& g = probe.gbuffer();
  const size_t middle = size_t{size_.height / 2} * size_.width + size_.width / 2;
  const double pixel = double{g.pixel_spread} * double{g.view_z[middle]}, side = 0.2 * size_.height * pixel;
  const DVec3 right = glm::normalize(DVec3(camera_.world_from_camera[0]));
  const DVec3 eye = DVec3(camera_.world_from_camera[3]), forward = glm::normalize(DVec3(camera_.world_from_camera[2]));
  pivot_ = eye + forward * double{g.view_z[middle]};
  const DVec3 centre = DVec3(g.position[middle]) + side * DVec3(g.geometric_normal[middle]);
  const DVec3 way = 0.1 * size_.width * pixel * right;
  MotionTrack track;
  const auto add_key = [&](double time, DVec3 at) { track.keys.push_back({time, at, {1, 0, 0, 0}, glm::dmat3(side)}); };
  add_key(0, centre - 0.5 * way), add_key(kGone - 1, centre + 0.5 * way);
  add_key(kGone, eye - (1.5 * double{radius_} + side) * forward);
  RigidMotion motion;
  motion.tracks.push_back(track);
  motion.instances.push_back({static_cast<uint32_t>(source_->instances().size() - 1), 0, kNoTrack, false, {}, 0.0});
  motion_.add(motion, motion_targets(file_));
  scene_.motion = &motion_;
}

FrameConfig DenoisedScene::config() const {
  FrameConfig config;
  config.size = size_;
  config.jitter = false, config.view_layers = true;
  config.ao.radius = radius_;
  return config;
}

Camera DenoisedScene::orbit(double degrees) const { return orbited(camera_, pivot_, up_, degrees); }

Camera DenoisedScene::elsewhere() const {
  Camera camera = orbit(25.0);
  camera.world_from_camera[3] += 0.3 * (pivot_ - DVec3(camera.world_from_camera[3]));
  return camera;
}

std::vector<float> DenoisedScene::truth(const Camera& camera, double time, uint32_t spp) const {
  FrameConfig exact = config();
  exact.denoise = false, exact.ao.spp = kTruthSamplesPerFrame, exact.ao.seed = 1;
  FrameLoop loop(scene_, exact);
  RenderedImage image;
  Progress progress;
  render_picture(loop, camera, time, spp / kTruthSamplesPerFrame, image, progress);
  return image.ao;
}

Quality DenoisedScene::compare(const std::vector<float>& ao, const std::vector<float>& truth) const {
  Image test(size_, 1), reference(size_, 1);
  std::vector<uint8_t> valid(size_.pixels());
  for (size_t i = 0; i < size_.pixels(); ++i)
    if (truth[i] >= 0.0f) valid[i] = 1, test.data[i] = std::max(ao[i], 0.0f), reference.data[i] = truth[i];
  const MetricOptions options{valid};
  return {psnr(test, reference, options).value, ssim(test, reference, options).value,
          flip(test, reference, options).value, packtrace::rmse(test, reference, options).value};
}

double DenoisedScene::rmse(const std::vector<float>& ao, const std::vector<float>& truth,
                           const std::vector<uint8_t>& pixels) {
  double sum = 0.0, count = 0.0;
  for (size_t i = 0; i < ao.size(); ++i)
    if (pixels[i] != 0 && truth[i] >= 0.0f) {
      const double error = double{ao[i]} - double{truth[i]};
      sum += error * error, count += 1.0;
    }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

RenderedImage next_picture(FrameLoop& loop, const Camera& camera, double time) {
  RenderedImage image;
  Progress progress;
  render_picture(loop, camera, time, 1, image, progress);
  return image;
}

size_t invalid_pixels(const RenderedImage& image) {
  size_t invalid = 0;
  for (size_t i = 0; i < image.ao.size(); ++i)
    invalid += image.coverage[i] > 0.0f && !(image.ao[i] >= 0.0f && image.ao[i] <= 1.0f) ? 1 : 0;
  return invalid;
}

} // namespace packtrace::test
