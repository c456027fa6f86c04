#include "runtime/frame/still.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

void StillConfig::validate() const {
  constexpr uint32_t kMaxFrames = 65536;
  FrameConfig::validate();
  if (frames < 1 || frames > kMaxFrames) throw Error(ErrorKind::kUsage, "frames must be in [1, 65536]");
}

StillReport render_still(FrameLoop& loop, const Camera& camera, uint32_t frames, bool stop_if_nothing_visible,
                         RenderedImage& image, Progress& progress) {
  StillReport sums;
  progress.begin("ambient occlusion", frames * loop.frame_pixels());
  for (uint32_t i = 0; i < frames; ++i) {
    const FrameReport& frame = loop.next_frame(camera, progress);
    sums.times += frame.times;
    sums.primary_rays += frame.primary_rays, sums.ao_rays += frame.ao_rays;
    if (i == 0) sums.seen = frame.seen;
    sums.seen |= frame.seen;
    if (!sums.seen && stop_if_nothing_visible) return sums;
  }
  loop.resolve(image, sums.times);
  return sums;
}

} // namespace packtrace
