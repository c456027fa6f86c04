// Pictures and sequences of other renderers, denoised.

#include "runtime/layered/layered_denoiser.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/image/image_test_support.h"
#include "tests/runtime/layered/foreign_pictures.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

constexpr ImageSize kSceneSize{64, 48};

/// Pictures of a noisy wall in a temporary folder.
class WallPictures {
public:
  std::filesystem::path write(uint32_t frame, const std::function<void(foreign::Channels&)>& change = {},
                              ImageSize size = kSceneSize) {
    foreign::Channels wall = foreign::wall(size, frame);
    if (change) change(wall);
    const std::filesystem::path file = folder_ / (std::to_string(count_++) + ".exr");
    foreign::write(file, size, wall);
    return file;
  }

private:
  TemporaryFolder folder_;
  int count_ = 0;
};

double error_of(const std::vector<float>& ao) {
  return synthetic::rmse_of(ao, kSceneSize, synthetic::all(kSceneSize),
                            [](uint32_t, uint32_t) { return synthetic::expected(0.5f); });
}

TEST(LayeredDenoiser, GivesTheSameAsTheDenoiserItself) {
  WallPictures pictures;
  LayeredDenoiser denoiser({}, MemoryBudget());
  AoDenoiser direct;
  for (uint32_t frame = 0; frame < 4; ++frame) {
    const LayeredResult& result = denoiser.next(pictures.write(frame), false);
    const DenoisedAo& expected =
        direct.next_frame(synthetic::wall(kSceneSize), synthetic::noise(kSceneSize, 0.5f, frame));
    EXPECT_EQ(result.image.ao, expected.ao) << frame;
    EXPECT_EQ(result.start, frame == 0 ? HistoryStart::kFirst : HistoryStart::kContinued);
    EXPECT_NEAR(result.mean_history, frame + 1, 1e-6);
    EXPECT_EQ(result.shared.value_or(1.0), 1.0);
  }
}

TEST(LayeredDenoiser, HistoryFollowsTheMotion) {
  const auto shifted = [](float pixels) {
    return [pixels](foreign::Channels& wall) {
      wall["motion.X"] = std::vector<float>(kSceneSize.pixels(), pixels);
      wall["motion.Y"] = std::vector<float>(kSceneSize.pixels(), 0.0f);
    };
  };
  WallPictures pictures;
  LayeredDenoiser denoiser({}, MemoryBudget());
  denoiser.next(pictures.write(0, shifted(0)), false);
  const LayeredResult& result = denoiser.next(pictures.write(1, shifted(16)), false);
  EXPECT_EQ(result.shared, 0.75);
  EXPECT_NEAR(result.mean_history, 1.75, 0.01);
}

TEST(LayeredDenoiser, HistoryEndsAtCutsNewSizesAndOtherScenes) {
  WallPictures pictures;
  const auto far = [](foreign::Channels& wall) {
    for (float& z : wall["depth"]) z = 50.0f;
  };
  LayeredDenoiser denoiser({}, MemoryBudget());
  denoiser.next(pictures.write(0), false);
  EXPECT_EQ(denoiser.next(pictures.write(1), true).start, HistoryStart::kCut);
  EXPECT_EQ(denoiser.next(pictures.write(2, far), false).start, HistoryStart::kNewScene);
  EXPECT_EQ(denoiser.next(pictures.write(3, far), false).start, HistoryStart::kContinued);
  const LayeredResult& smaller = denoiser.next(pictures.write(4, far, {32, 16}), false);
  EXPECT_EQ(smaller.start, HistoryStart::kNewSize);
  EXPECT_EQ(smaller.image.ao.size(), 32u * 16u);
  EXPECT_NEAR(smaller.mean_history, 1.0, 1e-6);
}

TEST(LayeredDenoiser, StillPicturesKeepTheirHistoryWhateverTheirRaysHit) {
  WallPictures pictures;
  const auto jittered = [](uint32_t frame) {
    return [frame](foreign::Channels& wall) { // an edge in the middle moves with the jitter
      for (size_t i = 0; i < kSceneSize.pixels(); ++i)
        if (i % kSceneSize.width < 32 + frame % 2) wall["depth"][i] = 20.0f;
    };
  };
  LayeredConfig config;
  config.still = true;
  LayeredDenoiser still(config, MemoryBudget()), moving({}, MemoryBudget());
  double still_history = 0.0, moving_history = 0.0;
  for (uint32_t frame = 0; frame < 8; ++frame) {
    const std::filesystem::path file = pictures.write(frame, jittered(frame));
    still_history = still.next(file, false).mean_history;
    moving_history = moving.next(file, false).mean_history;
  }
  EXPECT_NEAR(still_history, 8.0, 1e-6);
  EXPECT_LT(moving_history, still_history);
}

TEST(LayeredDenoiser, PixelsWithoutSamplesAreFilled) {
  WallPictures pictures;
  const auto holes = [](foreign::Channels& wall) {
    for (size_t i = 0; i < kSceneSize.pixels(); i += 5) wall["ao"][i] = std::nanf("");
  };
  LayeredDenoiser denoiser({}, MemoryBudget());
  denoiser.next(pictures.write(0, holes), false);
  const LayeredResult& result = denoiser.next(pictures.write(1, holes), false);
  for (const float ao : result.image.ao) ASSERT_TRUE(ao >= 0.0f && ao <= 1.0f);
  EXPECT_LT(error_of(result.image.ao), 0.2);
  EXPECT_GT(result.picture.counts.not_finite_ao, 600u);
}

TEST(LayeredDenoiser, CopiesKeepAllChannelsAndTheConventionOfTheOcclusion) {
  WallPictures pictures;
  const std::filesystem::path file = pictures.write(0, [](foreign::Channels& wall) {
    std::vector<float> occlusion = wall["ao"];
    for (float& value : occlusion) value = 1.0f - value;
    wall.erase("ao");
    wall["AO.R"] = wall["AO.G"] = wall["AO.B"] = occlusion;
    wall["AO.A"] = std::vector<float>(kSceneSize.pixels(), 0.5f);
    wall["depth"][7] = 0.0f, wall["AO.R"][7] = 0.125f;
    wall["other"] = std::vector<float>(kSceneSize.pixels(), 42.0f);
  });
  LayeredConfig config;
  config.reading.conventions.inverted_ao = true;
  LayeredDenoiser denoiser(config, MemoryBudget());
  const LayeredResult& result = denoiser.next(file, false);
  const std::array added{Layer{"raw", {""}, std::span<const float>(result.image.ao_raw)}};
  const ExrPicture copy(encode_denoised_copy(result, config.reading.conventions, added), "copy");
  EXPECT_EQ(copy.floats("other").front(), 42.0f);
  EXPECT_EQ(copy.floats("AO.A").front(), 0.5f);
  EXPECT_EQ(copy.floats("raw"), result.image.ao_raw);
  EXPECT_EQ(copy.floats("AO.G"), copy.floats("AO.R"));
  EXPECT_EQ(copy.floats("AO.R")[7], 0.125f) << "background";
  const std::vector<float> occlusion = copy.floats("AO.R");
  for (size_t i = 8; i < kSceneSize.pixels(); ++i) ASSERT_EQ(occlusion[i], 1.0f - result.image.ao[i]) << i;
}

} // namespace
} // namespace packtrace
