#pragma once

#include <span>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "runtime/ao/ao_config.h"
#include "runtime/camera/gbuffer.h"

namespace packtrace {

/// The box of something that moved between two frames; world space, relative to SceneSource::origin().
struct MovedBox {
  uint32_t instance = 0; ///< what moved; its own surfaces keep their history
  Bounds before, after;
  float moved = 1.0f; ///< [0,1]: largest distance that a corner moved, relative to half the diagonal
};

/// @param object_before, object_after object-space bounds in the two frames
MovedBox moved_box(uint32_t instance, const Bounds& object_before, const DAffine& world_before,
                   const Bounds& object_after, const DAffine& world_after);

/// Finds AoFrame::max_history: limits where occlusion may have changed because something moved.
///
/// A box is seen from a surface point with about the form factor F of a disc of its projected area,
///   F = occlusion(d) cos A / (A + pi d^2),
/// where d is the distance of its nearest point, A its area projected along the line to it, cos the mean cosine of the
/// part above the surface, and occlusion() AoConfig's curve. The change is estimated as
///   b^2 = sum over boxes (|F_after - F_before| + moved / 2 max(F_after, F_before))^2,
/// and the history is limited to 0.01 b^-3/2 frames: 0.03 where half of what a point sees may have changed, 10 where it
/// is a hundredth. What walls hide from a point counts, too. The surfaces of what moved are not limited by their own
/// box.
/// @param radius the AO radius in world units: ao_radius()
/// @return one entry per pixel, or none if there are no boxes
std::vector<float> history_limits(std::span<const MovedBox> boxes, const GBuffer& gbuffer, const AoConfig& config,
                                  float radius);

} // namespace packtrace
