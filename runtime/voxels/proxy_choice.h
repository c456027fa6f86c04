#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Chooses the instances that occlusion rays meet as voxels because that is faster. The model was fitted to
/// measurements (docs/voxels.md): of n voxels along its longest side, a proxy saves 6 % of a ray's time for each
/// doubling of triangles / n^2; rays elsewhere take 10 % longer, because they traverse a second tree. The choice
/// depends on scene and view only, not on times of a machine.
class ProxyChoice {
public:
  /// Throws Error(kUnsupported) for a file without voxels.
  explicit ProxyChoice(const BakedFile& file);

  /// Instances whose proxy saves time and whose size is below `pixels`: the diameter of the sphere around their box,
  /// divided by the length of a pixel at its nearest point. Flattened instances and geometries in world space are left
  /// out. Ascending.
  /// @param source of the file, with the transforms of the frame
  std::vector<uint32_t> small_instances(const SceneSource& source, const PrimaryCamera& view, double pixels) const;

  /// Whether the rays of all pixels together become faster: what is saved at pixels that show chosen instances exceeds
  /// what is lost at all others.
  /// @param chosen from small_instances()
  /// @param seen G-buffer of the source's level 0
  bool pays(std::span<const uint32_t> chosen, const SceneSource& source, const GBuffer& seen) const;

private:
  const BakedFile& file_;
  std::vector<double> saving_; ///< by geometry: fraction of a ray's time that its proxy saves
};

} // namespace packtrace
