#include "runtime/frame/still.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

void StillConfig::validate() const {
  constexpr uint32_t kMaxFrames = 65536;
  FrameConfig::validate();
  if (frames < 1 || frames > kMaxFrames) throw Error(ErrorKind::kUsage, "frames must be in [1, 65536]");
}

PictureReport render_picture(FrameLoop& loop, const Camera& camera, double time_s, uint32_t frames,
                             RenderedImage& image, Progress& progress) {
  PictureReport report;
  for (uint32_t i = 0; i < frames; ++i) report.add(loop.next_frame(camera, time_s, progress));
  loop.resolve(image, report);
  return report;
}

PictureReport render_still(FrameLoop& loop, const Camera& camera, double time_s, uint32_t frames,
                           bool stop_if_nothing_visible, RenderedImage& image, Progress& progress) {
  progress.begin("ambient occlusion", frames * loop.frame_pixels());
  PictureReport report;
  report.add(loop.next_frame(camera, time_s, progress));
  if (!report.seen && stop_if_nothing_visible) return report;
  for (uint32_t i = 1; i < frames; ++i) report.add(loop.next_frame(camera, time_s, progress));
  loop.resolve(image, report);
  return report;
}

} // namespace packtrace
