#pragma once

#include <optional>
#include <string>

#include "pbrt_import/scene/bounds.h"
#include "runtime/frame/camera_path.h"

namespace packtrace {

/// An interactive camera. It is one of the scene's until the first movement, and a key from then on: position, the
/// point that it looks at, up and field of view. Keys are in world coordinates with 9 significant digits, so that the
/// text of a key is the camera itself.
class ViewCamera {
public:
  /// @param base the camera to start from; its projection, screen window and handedness stay
  /// @param origin world coordinates of the scene's zero (SceneSource::origin())
  /// @param up unit vector; looking and turning keep the horizon perpendicular to it
  /// @param distance to what the camera looks at, along its axis; positive
  ViewCamera(const Camera& base, DVec3 origin, DVec3 up, double distance);

  const Camera& camera() const { return camera_; }
  /// The key; none while the camera is the base.
  const std::optional<CameraKey>& key() const { return key_; }
  /// The key of the camera as it is, with time 0.
  CameraKey current_key() const;

  /// Throws Error(kUsage) for a camera_key_problem().
  void set(const CameraKey& key);
  /// Goes back to the base.
  void reset();
  /// Adopts the base, origin and up of another scene, and keeps the camera and its pivot in place. The camera is the
  /// new base only if it has not moved and both bases are equal.
  void change_scene(const ViewCamera& other);
  /// This camera in another scene that is seen from the same place.
  /// @param origin, base of the other scene, as for the constructor
  Camera in_scene(DVec3 origin, const Camera& base) const;

  /// Moves by world units along the picture's axes: right, up, forward.
  void move(DVec3 steps);
  /// Turns the view without moving the camera. Degrees to the right and upwards; the view stays at least a degree off
  /// the vertical.
  void look(double right_degrees, double up_degrees);
  /// Turns the camera about its pivot. Negative angles move it to its right and upwards, so that with positive ones the
  /// object follows a mouse that moves right and down.
  void turn(double right_degrees, double up_degrees);
  /// Moves to a distance from which the whole box fits into the view, in the direction of the view.
  void frame(const Bounds& bounds);

  /// Unit vectors to the right, upwards and forwards for things that stand upright: up is the vertical.
  glm::dmat3 level_axes() const;

  /// The centre of turn(), relative to the origin; until it is set, the point that the base looks at.
  DVec3 pivot() const { return pivot_; }
  void set_pivot(DVec3 point) { pivot_ = point; }

private:
  glm::dmat3 rotation(double right_degrees, double up_degrees) const;
  void place(DVec3 position, DVec3 forward, DVec3 up);

  Camera base_, camera_;
  DVec3 origin_, vertical_, pivot_;
  double distance_;
  std::optional<CameraKey> key_;
};

/// A key's text: "PX,PY,PZ,LX,LY,LZ,UX,UY,UZ,FOV" with 9 significant digits.
std::string camera_key_text(const CameraKey& key);

/// Reads "PX,PY,PZ,LX,LY,LZ[,UX,UY,UZ[,FOV]]". Throws Error(kUsage) for other texts and for a camera_key_problem().
/// @param defaults up and field of view if the text has none
CameraKey parse_camera_key(const std::string& text, const CameraKey& defaults);

} // namespace packtrace
