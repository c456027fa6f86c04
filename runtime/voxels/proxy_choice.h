#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Which instances occlusion rays see as voxels because that makes them faster. What a proxy saves was measured
/// (docs/voxels.md): 6 % of the time of a ray for each doubling of the triangles above the square of the voxels along
/// the longest side. Rays near anything else take 10 % longer, as they pass a second tree. All of it depends on the
/// scene and the view only, not on times of a machine.
class ProxyChoice {
public:
  /// Throws Error(kUnsupported) for a file without voxels.
  explicit ProxyChoice(const BakedFile& file);

  /// Instances with a proxy that saves time, and that are seen smaller than so many pixels: the diameter of the sphere
  /// around their box over the length of a pixel at its nearest point. Flat instances and those of the tree of world
  /// space are not among them. Ascending.
  /// @param source of the file, as it is placed
  std::vector<uint32_t> small_instances(const SceneSource& source, const PrimaryCamera& view, double pixels) const;

  /// Whether all pixels' rays together become faster if these instances, as small_instances() returns them, are seen as
  /// voxels: what those of the pixels that show them save exceeds what those of all others cost.
  /// @param seen of level 0 of the source
  bool pays(std::span<const uint32_t> chosen, const SceneSource& source, const GBuffer& seen) const;

private:
  const BakedFile& file_;
  std::vector<double> saving_; ///< by geometry: part of a ray's time; not above 0: none
};

} // namespace packtrace
