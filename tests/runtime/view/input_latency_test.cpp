#include "runtime/view/input_latency.h"

#include <gtest/gtest.h>

namespace packtrace {
namespace {

TEST(InputLatency, PercentilesAreOfTheLastInputs) {
  InputLatency latency;
  EXPECT_EQ(latency.percentile_ms(0.95), 0.0);
  for (int ms = 100; ms >= 1; --ms) latency.add(ms);
  EXPECT_EQ(latency.count(), 100u);
  EXPECT_EQ(latency.percentile_ms(0.5), 50.0);
  EXPECT_EQ(latency.percentile_ms(0.95), 95.0);
  EXPECT_EQ(latency.percentile_ms(1.0), 100.0);
  for (int i = 0; i < 1024; ++i) latency.add(7.0);
  EXPECT_EQ(latency.count(), 1124u);
  EXPECT_EQ(latency.percentile_ms(1.0), 7.0) << "older ones are forgotten";
}

} // namespace
} // namespace packtrace
