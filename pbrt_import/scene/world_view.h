#pragma once

#include <span>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Orientation from which a world is viewed. Scenes do not store it, so it is estimated from the cameras.
struct WorldView {
  DVec3 up{0.0, 1.0, 0.0}; ///< a coordinate axis or its opposite
  bool mirrored = false;   ///< cameras mirror: the world is right-handed, pbrt's convention is left-handed
};

/// Estimates up and handedness of a world from its cameras. Without cameras: +y and left-handed, as usual in pbrt.
///
/// A camera is upright if the image of the vertical is vertical, whatever the elevation of the view. So an axis counts
/// by the cosine of the elevation that it would give the camera, fully if its image is within a degree of the image's
/// vertical, and little otherwise (rolled cameras). A camera in a plane of two axes looks upright for both: an axis by
/// which it looks upwards counts half, since cameras more often look down. The sums over all cameras decide; of equal
/// axes, y comes before z before x.
/// @param cameras those with a transform that is not finite or singular do not count
WorldView estimate_world_view(std::span<const Camera> cameras);

} // namespace packtrace
