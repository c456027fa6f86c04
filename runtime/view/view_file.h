#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/frame/scene_state.h"

namespace packtrace {

/// A file that is shown.
struct ViewFile {
  std::string name;                    ///< as it was given
  std::shared_ptr<const void> owner;   ///< of everything below
  FrameScene at_rest;                  ///< nothing moves
  FrameScene moving;                   ///< with the scene's motion; like at_rest if it has none
  double begin_s = 0.0, end_s = 0.0;   ///< of the motion
  const SceneMotion* motion = nullptr; ///< of the scene; moves nothing if `moving` has none
  /// The instances as files of keys address them, by number. Called when the first is needed.
  std::function<const MotionTargets&()> targets;
  std::vector<std::string> material_names; ///< by number
  /// Bytes by stream, and names of the geometries; not set for a .pbrt scene. Take a while: called when a panel shows
  /// them.
  std::function<std::vector<std::pair<std::string, uint64_t>>()> stream_bytes;
  std::function<std::vector<std::string>()> geometry_names;
  std::vector<std::string> words; ///< options with which `render` loads the file likewise, such as --world 2
  std::string base_camera = "0";  ///< `render --camera` that gives the camera to start from

  bool moves() const { return moving.motion != nullptr || moving.deforms; }
};

} // namespace packtrace
