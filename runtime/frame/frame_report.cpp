#include "runtime/frame/frame_report.h"

namespace packtrace {

PassTimes& PassTimes::operator+=(const PassTimes& other) {
  update_s += other.update_s, plan_s += other.plan_s, build_s += other.build_s, primary_s += other.primary_s,
      ao_s += other.ao_s, shade_s += other.shade_s;
  denoise_s += other.denoise_s, upsample_s += other.upsample_s, resolve_s += other.resolve_s;
  return *this;
}

void PictureReport::add(const FrameReport& frame) {
  ++frames;
  times += frame.times;
  primary_rays += frame.primary_rays, ao_rays += frame.ao_rays, shade_rays += frame.shade_rays;
  seen |= frame.seen, rebuilt |= frame.rebuilt;
}

} // namespace packtrace
