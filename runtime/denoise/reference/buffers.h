#pragma once

#include "runtime/denoise/plane.h"

namespace packtrace::reference {

/// Larger depths are stored as this one, so that squares of depths are finite.
inline constexpr float kLargestDepth = 1e18f;

/// The guides of a frame, sanitised: a depth that is not positive and finite is stored as 0, which means a miss; a
/// normal that is not finite is stored as a zero vector, which has weight 0 in every test.
struct Surfaces {
  ImageSize size;
  Plane<float> z; ///< linear view z
  Plane<float> normal_x, normal_y, normal_z;

  void resize(ImageSize new_size);
  /// Copies the guides of a G-buffer of the same size.
  void load(const GBuffer& gbuffer);
};

/// Change of view z per pixel along each axis.
struct Derivatives {
  Plane<float> x, y;

  void resize(ImageSize size) { x.resize(size), y.resize(size); }
};

/// What the next frame needs of a frame's AO. Pixels without history have value kInvalidAo and 0 in the other planes.
struct History {
  Plane<float> value;        ///< AO after the edge-stopping blur; kInvalidAo: none
  Plane<float> mean, square; ///< mean and mean square of the samples, never blurred or clamped
  Plane<float> distance;     ///< mean hit distance, world units
  Plane<float> tspp;         ///< history length in frames, fractional

  void resize(ImageSize size) {
    for (Plane<float>* plane : {&value, &mean, &square, &distance, &tspp}) plane->resize(size);
  }
  /// Discards the history of all pixels.
  void clear(ImageSize size);
};

struct Frame {
  Surfaces surfaces;
  History history;

  void resize(ImageSize size) { surfaces.resize(size), history.resize(size); }
};

} // namespace packtrace::reference
