#pragma once

#include <gtest/gtest.h>

#include "runtime/camera/gbuffer.h"

namespace packtrace::test {

/// Expects the arrays that every G-buffer has to be equal to the last bit.
inline void expect_same_surfaces(const GBuffer& gbuffer, const GBuffer& expected) {
  EXPECT_EQ(gbuffer.view_z, expected.view_z);
  EXPECT_EQ(gbuffer.position, expected.position);
  EXPECT_EQ(gbuffer.geometric_normal, expected.geometric_normal);
  EXPECT_EQ(gbuffer.normal, expected.normal);
  EXPECT_EQ(gbuffer.instance, expected.instance);
  EXPECT_EQ(gbuffer.offset, expected.offset);
  EXPECT_EQ(gbuffer.motion_px, expected.motion_px);
  EXPECT_EQ(gbuffer.previous_z, expected.previous_z);
}

} // namespace packtrace::test
