#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/frame/detail.h"
#include "runtime/frame/frame_report.h"
#include "runtime/motion/scene_motion.h"
#include "runtime/trace/make_tracer.h"

namespace packtrace {

class InstanceBoxes;
class InstanceLevels;
class MeshMotion;
class PackedTracer;
class ProxyChoice;
struct MovedBox;

/// The input of a FrameLoop. All references must outlive it.
struct FrameScene {
  const SceneSource* source = nullptr;
  const BakedFile* file = nullptr; ///< the file that `source` reads; null for an imported scene
  TracerConfig backend;
  const SceneMotion* motion = nullptr; ///< of the instances; null: none moves
  bool deforms = false;                ///< plays the deforming meshes of `file`, again and again; backend packed only
  Bounds motion_bounds = {};           ///< of all moving instances at all times; empty: those of `motion`
  std::optional<MemoryBudget> memory = {}; ///< reserves the memory of mip levels of textures; unset: no limit
};

/// A scene at the time of a frame, ready to be traced: places of instances, vertices of deforming meshes, levels by
/// distance, levels of detail, and the tracers. Keeps the previous state for motion vectors.
class SceneState {
public:
  /// Throws Error(kUsage) for levels of detail without a file, Error(kUnsupported) for deforming meshes with another
  /// backend than packed.
  SceneState(const FrameScene& scene, const DetailConfig& detail);
  ~SceneState();

  /// Replaces the motion. Returns false, without a change, if it moves other instances or leaves the bounds of the
  /// motion so far.
  bool follow_motion(const SceneMotion& motion);

  /// Advances to the next frame. Returns whether something moved or changed since the previous one.
  /// @param eye chooses the levels by distance
  /// @param report receives times and rebuilt trees
  bool advance(DVec3 eye, double time_s, FrameReport& report);

  /// Chooses the levels of detail for a view, and builds their trees if they changed. Needs a detail with an error.
  /// @param seen as in DetailPlanner::plan()
  void choose_detail(const PrimaryCamera& view, const GBuffer* seen, FrameReport& report);
  /// Makes the tracer of level 0 if there is none.
  void build_level_0(FrameReport& report);

  /// Chooses the instances that occlusion rays see as proxies, and creates their tracer if they changed. Then measures
  /// the error of ambient occlusion, and uses triangles for all of them if it exceeds `most_error`.
  /// @param seen, pixels as in ProxyChoice
  /// Throws Error(kUnsupported) without a file, or if something moves.
  void choose_proxies(const PrimaryCamera& view, const GBuffer& seen, double pixels, double most_error,
                      const AoConfig& ao, FrameReport& report);
  /// The error measured for the last choice of ProxyChoice; none if it chose no instance.
  std::optional<double> proxy_error() const { return proxy_error_; }

  /// Forgets the frame before.
  void reset();
  /// Returns the state on which advance() depends besides its arguments, for restore().
  std::vector<uint8_t> save() const;
  /// Restores a saved frame. Returns false if its state belongs to another scene.
  bool restore(double time_s, std::span<const uint8_t> saved, FrameReport& report);

  const FrameScene& scene() const { return scene_; }
  const DetailPlanner* planner() const { return planner_.get(); }
  /// The source of the tracer of occlusion rays.
  const SceneSource& traced_source() const;
  /// The source of the tracer of camera rays.
  const SceneSource& camera_source() const;
  /// The tracers in use: the camera's, and with DetailConfig::only_occlusion or proxies also the occlusion rays'.
  std::vector<const RayTracer*> tracers() const;

  /// Transforms of all instances in the frame before; empty if none moves.
  std::span<const Affine> previous_transforms() const { return last_world_; }
  /// The boxes that advance() has moved since the frame before.
  std::span<const MovedBox> moved_boxes() const;
  /// The tracer of camera rays if it shows deforming meshes, else null.
  const PackedTracer* deforming_tracer() const;

private:
  bool pose_instances(double time_s, FrameReport& report);
  bool apply_levels(FrameReport& report);
  bool deform_meshes(double time_s, FrameReport& report);
  void follow_boxes();
  std::unique_ptr<RayTracer> posed(std::unique_ptr<RayTracer> tracer) const;

  FrameScene scene_;
  DetailConfig detail_;
  std::unique_ptr<PackedSource> leveled_source_; ///< scene_.source if there are levels by distance
  std::unique_ptr<InstanceLevels> levels_;       ///< null if there are none
  std::unique_ptr<DetailPlanner> planner_;
  std::unique_ptr<RayTracer> level_0_;        ///< null if only levels are traced and nothing deforms
  std::unique_ptr<RayTracer> level_tracer_;   ///< traces planner_->source()
  std::unique_ptr<RayTracer> proxy_tracer_;   ///< null if no instance is seen as its proxy
  std::unique_ptr<ProxyChoice> proxy_choice_; ///< null until one is needed
  std::vector<uint32_t> proxied_;             ///< instances for which proxy_tracer_ was made, even if it was dropped
  std::optional<double> proxy_error_;
  std::unique_ptr<MeshMotion> meshes_;   ///< null if no mesh deforms
  std::unique_ptr<InstanceBoxes> boxes_; ///< null if nothing moves
  bool started_ = false;                 ///< there is a frame before
  std::vector<Affine> pose_, last_pose_; ///< by SceneMotion::moving_instances(): of this frame and the previous one
  std::vector<Affine> last_world_;       ///< world_from_object of all instances in the previous frame
};

} // namespace packtrace
