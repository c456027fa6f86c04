#include "runtime/view/quality_control.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

FrameConfig full() {
  FrameConfig config;
  config.size = {960, 540};
  return config;
}

TEST(QualityControl, StepsReducePixelsAndThenRays) {
  EXPECT_EQ(at_quality_step(full(), 0).size, (ImageSize{960, 540}));
  EXPECT_EQ(at_quality_step(full(), 1).size, (ImageSize{840, 472}));
  EXPECT_EQ(at_quality_step(full(), 4).size, (ImageSize{480, 270}));
  EXPECT_EQ(at_quality_step(full(), 4).ao_rate, AoRate::kFull);
  EXPECT_EQ(at_quality_step(full(), 5).ao_rate, AoRate::kCheckerboard);
  EXPECT_EQ(at_quality_step(full(), 6).ao_resolution, AoResolution::kQuarter);
  FrameConfig pixel;
  pixel.size = {1, 1};
  EXPECT_EQ(at_quality_step(pixel, 6).size, (ImageSize{1, 1}));
}

/// Frame times of a machine whose time goes with the pixels and, from step 5 on, falls with the rays.
double frame_ms(double full_ms, uint32_t step) {
  const FrameConfig config = at_quality_step(full(), step);
  const double pixels = static_cast<double>(config.size.pixels()) / static_cast<double>(full().size.pixels());
  return full_ms * pixels * (step == 5 ? 0.8 : step == 6 ? 0.6 : 1.0);
}

uint32_t step_after(double full_ms, double target_ms, int frames) {
  QualityControl control(target_ms);
  for (int i = 0; i < frames; ++i) control.add(frame_ms(full_ms, control.step()));
  return control.step();
}

TEST(QualityControl, ReachesTheTargetWhereItCan) {
  EXPECT_EQ(step_after(20, 33, 100), 0u);
  EXPECT_EQ(step_after(500, 0, 100), 0u) << "no target";
  EXPECT_EQ(step_after(1000, 33, 100), kCheapestStep) << "out of reach";
  for (const double full_ms : {40.0, 60.0, 90.0, 120.0}) {
    const uint32_t step = step_after(full_ms, 33, 100);
    EXPECT_LE(frame_ms(full_ms, step), 33 * 1.1) << full_ms;
    EXPECT_EQ(step_after(full_ms, 33, 4), step) << "within four frames";
  }
}

TEST(QualityControl, AStillFrameChoosesTheFirstStep) {
  QualityControl control(33);
  control.start(20);
  EXPECT_EQ(control.step(), 0u);
  control.start(90);
  const uint32_t step = control.step();
  EXPECT_LE(frame_ms(90, step), 33 * 1.1);
  EXPECT_GT(frame_ms(90, step - 1), 33 * 1.1);
  control.add(frame_ms(90, step));
  control.start(1000);
  EXPECT_EQ(control.step(), step) << "moving frames know better";
  QualityControl unlimited(0);
  unlimited.start(1000);
  EXPECT_EQ(unlimited.step(), 0u);
}

TEST(QualityControl, OneSlowFrameChangesNothing) {
  QualityControl control(33);
  for (int i = 0; i < 50; ++i) control.add(i % 2 == 0 ? 80 : 30);
  EXPECT_EQ(control.step(), 0u);
}

TEST(QualityControl, ComesBackWhenFramesGetCheaper) {
  QualityControl control(33);
  for (int i = 0; i < 10; ++i) control.add(frame_ms(120, control.step()));
  EXPECT_GT(control.step(), 0u);
  for (int i = 0; i < 200; ++i) control.add(frame_ms(20, control.step()));
  EXPECT_EQ(control.step(), 0u);
}

} // namespace
} // namespace packtrace
