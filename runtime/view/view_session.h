#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/image/image.h"
#include "runtime/view/file_contents.h"
#include "runtime/view/gizmo.h"
#include "runtime/view/hand_moves.h"
#include "runtime/view/pane.h"
#include "runtime/view/pick.h"
#include "runtime/view/quality_control.h"
#include "runtime/view/view_camera.h"
#include "runtime/view/view_difference.h"

namespace packtrace {

/// Arrangement of the two panes of a view.
enum class SplitMode : uint8_t {
  kOff,        ///< the first pane alone
  kDivider,    ///< the first left of the divider, the second right of it
  kDifference, ///< their difference
};

/// Report of a frame of a view.
struct ViewFrame {
  bool moving = false;
  uint32_t still_frames = 0; ///< frames of the still picture, 0 while something moves
  uint32_t quality_step = 0; ///< at_quality_step()
  double time_s = 0.0;       ///< of the scene's motion
  ImageSize traced;          ///< pixels that were traced, of the first pane
  PictureReport report;      ///< sums over the panes
};

/// The layers that a pane can show: those of `render --aov`, "ground_truth", and "pbr+ao".
std::vector<std::string> view_layer_names();

/// A viewer without a window: files, two panes, a camera, and successive frames. While something moves, each frame
/// continues the history of the one before, at a lower quality if QualityControl chooses it. Once nothing moves, a
/// still picture begins: its N-th frame has the bytes that `render --frames N` writes for command().
///
/// Frames depend on the calls only, not on the number of threads. Use it from one thread at a
/// time.
class ViewSession {
public:
  struct Config {
    ImageSize size;
    FrameConfig frame; ///< AoConfig::radius is 0 unless one was chosen
    double target_ms = 0.0;
    MemoryBudget memory;
  };

  /// @param files at least one; the first one's camera and up axis control the view
  /// @param camera of the first file
  ViewSession(std::vector<ViewFile> files, ViewCamera camera, const Config& config);

  // State of the view. Setters restart the still picture if they change the rendered image. They throw Error(kUsage)
  // for invalid values, without a change.
  const std::vector<ViewFile>& files() const { return files_; }
  /// Replaces a file, for example by its new content; camera and settings stay.
  /// @param start its own camera
  void replace_file(size_t index, ViewFile file, const ViewCamera& start);
  void add_file(ViewFile file);
  void resize(ImageSize size);
  ImageSize size() const { return size_; }
  void set_split(SplitMode mode);
  SplitMode split() const { return split_; }
  /// @param fraction of the picture's width, clamped to [0, 1]
  void set_divider(double fraction);
  double divider() const { return divider_; }
  /// @param gain in (0, 1000]
  void set_gain(double gain);
  double gain() const { return gain_; }
  const PaneState& pane(size_t index) const { return panes_[index]; }
  void set_layer(size_t pane, const std::string& layer);
  void set_file(size_t pane, size_t file);
  void set_setting(size_t pane, std::string_view name, std::string_view value);
  /// @param target_ms in [0, 1e6]; 0: frames take the time that they need
  void set_target_ms(double target_ms);
  double target_ms() const { return quality_.target_ms(); }
  /// Sets the quality step of moving frames; none: QualityControl chooses it.
  void fix_quality(std::optional<uint32_t> step);
  /// Begins the still picture again with the next frame.
  void restart() { restart_ = true; }
  /// Whether images have the denoiser's and tracer's views even if no pane shows one, and all other layers without
  /// being asked for, as picks of every frame need them.
  void keep_views(bool kept) { keep_views_ = kept; }

  // The camera and the scene's time.
  const ViewCamera& camera() const { return camera_; }
  /// Moves the camera, for the next frame: change(ViewCamera&).
  template <typename Change>
  void move_camera(const Change& change) {
    change(camera_);
    moved_ = true;
  }
  /// Shows the scene at a time of its motion, or at rest.
  void set_time(std::optional<double> time_s);
  std::optional<double> time() const { return time_; }
  /// Turns the lights of both panes about the vertical (ShadeConfig::light_turn).
  void turn_lights(double degrees);
  /// Picks the instance in a pixel of a pane to be moved, or none. Returns its name, empty if there is none.
  std::string select(size_t pane, uint32_t x, uint32_t y);
  /// The picked instance.
  struct Selection {
    size_t file;
    uint32_t instance;
  };
  const std::optional<Selection>& selection() const { return selection_; }
  /// Moves the picked instance by world units. A scene that moves is shown at a time from then on. Throws Error(kUsage)
  /// if there is none, and if it cannot move.
  void move_selected(DVec3 by);
  /// Moves the picked instance back to its original place.
  void put_selected_back();
  /// The handles of the picked instance; none if it cannot be seen.
  std::optional<Gizmo> gizmo() const;
  /// Drags a handle of gizmo().
  /// @param axis 0 to 2
  /// @param by fractions of the picture, x right, y down
  void drag_gizmo(size_t axis, glm::dvec2 by);
  /// The instances of a file that were moved.
  const HandMoves& hand_moves(size_t file) const { return hand_moves_[file]; }
  /// Sets the file to which the keys of the moved instances of a file were saved (HandMoves::keys_text()), for
  /// command().
  void set_keys_file(size_t file, const std::string& name) { hand_moves_.at(file).set_keys_file(name); }
  /// Points the pivot at the surface in a pixel of the first pane. Returns false if there is none.
  bool set_pivot(uint32_t x, uint32_t y);
  /// Makes the first pane's bounds fill the view.
  void frame_scene();

  /// Renders the next frame of all panes that are shown. Returns false if the observer of the progress ended it by
  /// Error(kCancelled); the still picture then begins again. Throws like FrameLoop::next_frame(), and MemoryError.
  bool step(Progress& progress);
  /// step() for a still picture of one frame: the next step begins a new picture, which needs less memory.
  bool step_once(Progress& progress);
  /// Renders a frame if something has changed since the last one, so that the picture shows it. Returns like step().
  bool settle(Progress& progress) { return moved_ || changed_ || last_.report.frames == 0 ? step(progress) : true; }
  const ViewFrame& last() const { return last_; }
  /// Whether the next frame restarts the image, because something moved or changed since the last one.
  bool changed() const { return moved_ || restart_ || changed_; }
  /// Reports how long the last frame took, for QualityControl.
  void add_frame_time(double ms) {
    if (last_.moving)
      quality_.add(ms);
    else if (last_.still_frames == 1)
      quality_.start(ms);
  }

  // The result of the frames so far; needs a step() before.
  /// The image of a pane with all plain layers; of the first one for a pane that is not shown.
  const RenderedImage& image(size_t pane);
  /// image() with only the layers that are shown, which needs less memory.
  const RenderedImage& shown_image(size_t pane);
  /// The settings with which it was rendered.
  const FrameConfig& rendered_config(size_t pane) const;
  /// The picture on the screen, as three channels of display values, without legends.
  Image picture();
  DifferenceMetrics metrics();
  /// What the file of a pane consists of; of the first pane for one that is not shown.
  FileContents contents(size_t pane) const;
  /// @param x, y pixel of the picture of size()
  Pick pick(size_t pane, uint32_t x, uint32_t y);
  /// The pane at a column of the picture.
  size_t pane_at(uint32_t x) const;
  /// The words of the command whose picture of this layer has the same bytes as the pane's, without outputs; empty
  /// while something moves. Needs settle() before.
  std::vector<std::string> command(size_t pane) const;

private:
  size_t shown_panes() const { return split_ == SplitMode::kOff ? 1 : 2; }
  void prepare(uint32_t quality);
  FrameConfig frame_config(const PaneState& pane, uint32_t quality) const;
  std::array<uint32_t, 2> traced_pixel(size_t pane, uint32_t x, uint32_t y) const;
  std::optional<Pick::Surface> surface(size_t pane, uint32_t x, uint32_t y) const;
  void require_layer(const PaneState& pane) const;
  void change_pane(size_t index, const PaneState& changed);
  Camera camera_in(size_t file) const;
  void show_moved();
  void resolve();

  std::vector<ViewFile> files_;
  ViewCamera camera_;
  ImageSize size_;
  MemoryBudget memory_;
  QualityControl quality_;
  std::optional<uint32_t> fixed_quality_;
  std::array<PaneState, 2> panes_;
  std::array<std::shared_ptr<PaneRenderer>, 2> renderers_; ///< the same if both panes are rendered alike
  SplitMode split_ = SplitMode::kOff;
  double divider_ = 0.5, gain_ = 8.0;
  std::optional<double> time_;
  std::vector<HandMoves> hand_moves_; ///< by file
  std::optional<Selection> selection_;
  bool keep_views_ = false;
  bool once_ = false;  ///< the frame is that of step_once()
  bool moved_ = false; ///< since the last frame
  uint32_t still_frames_ = 0;
  bool restart_ = true;   ///< the next still frame is the first
  bool changed_ = false;  ///< panes, settings or the size, since the last frame
  bool resolved_ = false; ///< the images are those of the last frame
  ViewFrame last_;
};

} // namespace packtrace
