#include "pbrt_import/base/error.h"
#include "runtime/view/view_session.h"

namespace packtrace {

std::string ViewSession::select(size_t pane, uint32_t x, uint32_t y) {
  const std::optional<Pick::Surface> picked = surface(pane, x, y);
  selection_.reset();
  if (!picked) return {};
  selection_ = {panes_[renderers_.at(pane) ? pane : 0].file, picked->instance};
  return picked->instance_name;
}

/// Shows the scene after an instance was moved.
void ViewSession::show_moved() {
  const ViewFile& file = files_[selection_->file];
  if (file.moves() && !time_) time_ = file.begin_s;
  if (!camera_.key()) camera_.set(camera_.current_key()); // `render` shows the scene's camera where it moves to
  moved_ = true;
}

void ViewSession::move_selected(DVec3 by) {
  if (!selection_) throw Error(ErrorKind::kUsage, "nothing is picked; click an object to move it");
  hand_moves_[selection_->file].move(files_[selection_->file], selection_->instance, by);
  show_moved();
}

void ViewSession::put_selected_back() {
  if (!selection_) throw Error(ErrorKind::kUsage, "nothing is picked; click an object first");
  hand_moves_[selection_->file].put_back(files_[selection_->file], selection_->instance);
  show_moved();
}

std::optional<Gizmo> ViewSession::gizmo() const {
  if (!selection_ || !files_[selection_->file].targets) return std::nullopt;
  const ViewFile& file = files_[selection_->file];
  const DVec3 centre = hand_moves_[selection_->file].centre(file, selection_->instance, time_.value_or(file.begin_s));
  return gizmo_at(centre, camera_in(selection_->file), size_);
}

void ViewSession::drag_gizmo(size_t axis, glm::dvec2 by) {
  const std::optional<Gizmo> handles = gizmo();
  if (!handles) return;
  DVec3 move(0.0);
  move[static_cast<int>(axis)] = dragged_distance(*handles, axis, by, size_);
  move_selected(move);
}

} // namespace packtrace
