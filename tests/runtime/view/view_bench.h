#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "runtime/trace/source/float_source.h"
#include "runtime/view/view_session.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace::test {

/// A floor and a ball with a camera, as a file of a view.
class ViewBench {
public:
  /// @param shading the scene has a light
  explicit ViewBench(bool shading = false) {
    add_shape(scene_, quad(Vec3(-4, 0, -4), Vec3(0, 0, 8), Vec3(8, 0, 0)));
    add_shape(scene_, sphere(Vec3(0, 1, 0), 1.0f, 24));
    scene_.cameras.push_back(camera());
    if (shading) {
      scene_.has_shading = true;
      Light sun;
      sun.kind = LightKind::kDistant, sun.direction = glm::normalize(Vec3(1, 1, -1));
      scene_.lights.push_back(sun);
    }
    source_ = std::make_unique<FloatSource>(scene_);
    motion_ = SceneMotion::of(scene_);
    targets_ = motion_targets(scene_);
    targets_.instances[0].fixed = true; // as the ground of a file
  }

  static Camera camera() { return camera_at(DVec3(0.5, 2, -6), DVec3(0, 1, 0), 50.0); }
  ViewFile file(const char* name = "ball.pbrt") const {
    ViewFile view;
    view.name = name;
    view.owner = std::make_shared<int>(0);
    view.at_rest.source = view.moving.source = source_.get();
    view.motion = &motion_;
    view.targets = [this]() -> const MotionTargets& { return targets_; };
    view.material_names.assign(source_->materials().size(), "chalk");
    return view;
  }
  static ViewSession::Config config() {
    ViewSession::Config config;
    config.size = {48, 32};
    config.frame.size = config.size;
    return config;
  }
  ViewSession session(size_t files = 1) const {
    std::vector<ViewFile> shown;
    for (size_t i = 0; i < files; ++i) shown.push_back(file());
    return {std::move(shown), ViewCamera(camera(), DVec3(0), DVec3(0, 1, 0), 6.0), config()};
  }
  const FloatSource& source() const { return *source_; }
  const SceneMotion& motion() const { return motion_; }
  const MotionTargets& targets() const { return targets_; }

private:
  Scene scene_;
  std::unique_ptr<FloatSource> source_;
  SceneMotion motion_;
  MotionTargets targets_;
};

inline void step(ViewSession& session, uint32_t frames) {
  Progress progress;
  for (uint32_t i = 0; i < frames; ++i) session.step(progress);
}

} // namespace packtrace::test
