#include "runtime/lod/compaction.h"

#include <algorithm>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

/// A device whose frames finish late, and which checks every memory access.
class FakeDevice : public BlasMemoryBackend {
public:
  explicit FakeDevice(uint32_t frames_in_flight) : in_flight_(frames_in_flight) {}

  void set_size(uint32_t blas, uint64_t worst_case, uint64_t compacted) { sizes_[blas] = {worst_case, compacted}; }
  void begin_frame() { ++frame_; }
  /// Records a frame that traces the buffer.
  void trace(BlasBuffer buffer) {
    ASSERT_TRUE(live_.contains(buffer)) << "traces memory that was released";
    ASSERT_TRUE(live_[buffer].filled) << "traces memory that nothing was built into";
    live_[buffer].last_use = frame_;
  }

  BlasBuffer allocate(uint64_t bytes) override {
    live_[++next_] = {bytes, 0, false};
    bytes_ += bytes;
    peak_ = std::max(peak_, bytes_);
    return next_;
  }
  void release(BlasBuffer buffer) override {
    ASSERT_TRUE(live_.contains(buffer)) << "released twice";
    EXPECT_LE(live_[buffer].last_use + in_flight_, frame_) << "released under a frame in flight";
    bytes_ -= live_[buffer].bytes;
    live_.erase(buffer);
  }
  uint64_t worst_case_bytes(uint32_t blas) override { return sizes_[blas].first; }
  void record_build(uint32_t blas, BlasBuffer into) override {
    EXPECT_GE(live_[into].bytes, sizes_[blas].first);
    live_[into].filled = true;
    live_[into].last_use = built_[blas] = frame_;
  }
  uint64_t compacted_bytes(uint32_t blas) override {
    EXPECT_LE(built_[blas] + in_flight_, frame_) << "asked before the build has run";
    return sizes_[blas].second;
  }
  void record_copy(uint32_t blas, BlasBuffer from, BlasBuffer to) override {
    EXPECT_TRUE(live_.contains(from) && live_[from].filled);
    EXPECT_GE(live_[to].bytes, sizes_[blas].second);
    live_[from].last_use = live_[to].last_use = frame_;
    live_[to].filled = true;
    copied_ += sizes_[blas].second;
  }

  uint64_t bytes() const { return bytes_; }
  uint64_t peak() const { return peak_; }
  uint64_t take_copied() { return std::exchange(copied_, 0); }
  size_t buffers() const { return live_.size(); }

private:
  struct Memory {
    uint64_t bytes = 0, last_use = 0;
    bool filled = false;
  };
  uint64_t in_flight_, frame_ = 0, next_ = 0, bytes_ = 0, peak_ = 0, copied_ = 0;
  std::map<BlasBuffer, Memory> live_;
  std::map<uint32_t, std::pair<uint64_t, uint64_t>> sizes_;
  std::map<uint32_t, uint64_t> built_;
};

/// Random builds and removals over many frames, then idle frames: memory is never accessed after release or before its
/// build, the byte counts are right, and everything ends compacted.
TEST(Compaction, RandomFramesEndCompactedAndNeverFreeWhatIsInFlight) {
  size_t copies = 0;
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    test::Random random(seed);
    CompactionConfig config;
    config.frames_in_flight = 1 + seed % 4;
    config.bytes_per_frame = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 5000 : uint64_t{1} << 40;
    FakeDevice device(config.frames_in_flight);
    BlasCompactor compactor(device, config);
    std::map<uint32_t, bool> live; // value: animated
    std::map<uint32_t, std::pair<uint64_t, uint64_t>> sizes;
    const auto frame = [&](bool busy) {
      device.begin_frame();
      device.take_copied();
      compactor.begin_frame();
      const uint64_t copied = device.take_copied();
      EXPECT_LE(copied, std::max<uint64_t>(config.bytes_per_frame, 4400)); // at least one is copied
      for (uint32_t k = 0; busy && k < random.bits() % 6; ++k) {
        const uint32_t blas = random.bits() % 40;
        if (live.contains(blas)) {
          compactor.remove(blas);
          live.erase(blas);
          if (random.bits() % 2 == 0) continue; // otherwise the number is reused in the same frame
        }
        const uint64_t worst = 1 + random.bits() % 4000, compacted = worst * (random.bits() % 110) / 100;
        device.set_size(blas, worst, compacted);
        sizes[blas] = {worst, compacted};
        live[blas] = random.bits() % 8 == 0;
        compactor.add(blas, blas % 5, live[blas]);
      }
      for (const auto& [blas, animated] : live) device.trace(compactor.buffer_of(blas));
      EXPECT_EQ(compactor.resident_bytes(), device.bytes());
      EXPECT_EQ(compactor.peak_bytes(), device.peak());
    };
    for (int i = 0; i < 200; ++i) frame(true);
    for (int i = 0; i < 60; ++i) frame(false);
    uint64_t expected = 0, worst_case = 0;
    for (const auto& [blas, animated] : live) {
      EXPECT_EQ(compactor.state_of(blas), BlasMemoryState::kSettled);
      const auto [worst, compacted] = sizes[blas];
      const bool worthwhile = !animated && compacted < worst &&
                              static_cast<double>(compacted) <= (1.0 - config.smallest_saving) * double(worst);
      expected += worthwhile ? compacted : worst;
      worst_case += worst;
    }
    EXPECT_EQ(compactor.resident_bytes(), expected);
    EXPECT_EQ(device.buffers(), live.size());
    uint64_t now = 0, built = 0;
    for (const auto& [geometry, bytes] : compactor.geometry_bytes()) now += bytes.now, built += bytes.worst_case;
    EXPECT_EQ(now, expected);
    EXPECT_EQ(built, worst_case);
    copies += compactor.copies();
    for (const auto& [blas, animated] : std::map(live)) compactor.remove(blas);
    live.clear();
    for (int i = 0; i < 6; ++i) frame(false);
    EXPECT_EQ(device.buffers(), 0u);
    EXPECT_EQ(compactor.resident_bytes(), 0u);
  }
  EXPECT_GT(copies, 1000u);
}

TEST(Compaction, GoesThroughItsStatesInFrames) {
  CompactionConfig config;
  config.frames_in_flight = 3;
  FakeDevice device(3);
  BlasCompactor compactor(device, config);
  const auto begin = [&] {
    device.begin_frame();
    compactor.begin_frame();
  };
  device.set_size(7, 1000, 400);
  begin(); // frame 1
  compactor.add(7, 0);
  const BlasBuffer source = compactor.buffer_of(7);
  for (int frame = 2; frame <= 3; ++frame) {
    begin();
    EXPECT_EQ(compactor.state_of(7), BlasMemoryState::kBuilding);
    EXPECT_EQ(compactor.buffer_of(7), source);
  }
  begin(); // frame 4: frame 1 has finished; measured and copied
  EXPECT_EQ(compactor.state_of(7), BlasMemoryState::kSettled);
  EXPECT_NE(compactor.buffer_of(7), source);
  EXPECT_EQ(compactor.resident_bytes(), 1400u);
  for (int frame = 5; frame <= 6; ++frame) {
    begin();
    EXPECT_EQ(compactor.resident_bytes(), 1400u); // frames that trace the source may still run
  }
  begin(); // frame 7
  EXPECT_EQ(compactor.resident_bytes(), 400u);
  EXPECT_EQ(compactor.peak_bytes(), 1400u);
  EXPECT_EQ(compactor.geometry_bytes().at(0).worst_case, 1000u);
  EXPECT_EQ(compactor.geometry_bytes().at(0).now, 400u);
}

TEST(Compaction, CopiesWithinItsBudgetAndOneInAnyCase) {
  CompactionConfig config;
  config.frames_in_flight = 1;
  config.bytes_per_frame = 250;
  FakeDevice device(1);
  BlasCompactor compactor(device, config);
  for (uint32_t blas = 0; blas < 7; ++blas) device.set_size(blas, 1000, blas == 6 ? 900 : 100);
  device.begin_frame();
  compactor.begin_frame();
  for (uint32_t blas = 0; blas < 7; ++blas) compactor.add(blas, 0);
  for (const uint64_t copied : {200, 200, 200, 900, 0}) { // the fourth alone exceeds the budget
    device.begin_frame();
    compactor.begin_frame();
    EXPECT_EQ(device.take_copied(), copied);
  }
}

TEST(Compaction, LeavesAnimatedOnesAndSmallSavingsAlone) {
  CompactionConfig config;
  config.smallest_saving = 0.1;
  FakeDevice device(config.frames_in_flight);
  BlasCompactor compactor(device, config);
  device.set_size(0, 1000, 10);
  device.set_size(1, 1000, 901);
  device.set_size(2, 1000, 900);
  compactor.add(0, 0, true);
  compactor.add(1, 0);
  compactor.add(2, 0);
  for (int frame = 0; frame < 10; ++frame) {
    device.begin_frame();
    compactor.begin_frame();
  }
  EXPECT_EQ(compactor.copies(), 1u);
  EXPECT_EQ(compactor.resident_bytes(), 2900u);
}

TEST(Compaction, BadKnobsAreRejected) {
  FakeDevice device(2);
  const auto reject = [&](const auto& change) {
    CompactionConfig config;
    change(config);
    EXPECT_THROW(BlasCompactor(device, config), Error);
  };
  reject([](CompactionConfig& c) { c.frames_in_flight = 0; });
  reject([](CompactionConfig& c) { c.frames_in_flight = 17; });
  reject([](CompactionConfig& c) { c.bytes_per_frame = 0; });
  reject([](CompactionConfig& c) { c.smallest_saving = -0.1; });
}

} // namespace
} // namespace packtrace
