#pragma once

#include <cstdint>
#include <functional>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/image/image.h"

namespace packtrace {

/// Uniform random numbers in [0,1), identical on all machines.
class Noise {
public:
  explicit Noise(uint64_t seed) : state_(seed) {}
  float operator()() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<float>(state_ >> 40) * 0x1p-24f;
  }

private:
  uint64_t state_;
};

inline Image noise_image(ImageSize size, uint32_t channels, uint64_t seed) {
  Image image(size, channels);
  Noise noise(seed);
  for (float& value : image.data) value = noise();
  return image;
}

/// Returns the kind of the Error that `function` throws. Fails the test if it throws nothing or another exception.
inline ErrorKind error_kind_of(const std::function<void()>& function) {
  try {
    function();
  } catch (const Error& error) {
    return error.kind();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not an Error: " << error.what();
    return ErrorKind::kUsage;
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorKind::kUsage;
}

} // namespace packtrace
