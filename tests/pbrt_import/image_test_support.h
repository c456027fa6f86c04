#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/image_file.h"

/// What the tests of image formats share.
namespace packtrace::image_test {

inline constexpr uint64_t kBudget = 64u << 20;

inline ImageSummary read(const std::string& file, bool want_mask = false) {
  return read_image(std::as_bytes(std::span(file)), false, want_mask, kBudget);
}

/// Message of the Error that reading a file throws; "" if there is none.
inline std::string complaint(const std::string& file) {
  try {
    (void)read(file, true);
    return "";
  } catch (const Error& error) {
    EXPECT_TRUE(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kLimitExceeded) << error.what();
    return error.what();
  }
}

inline void expect_average(const std::string& file, Vec3 average, float tolerance = 1e-6f) {
  const ImageSummary image = read(file);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.average[c], average[c], tolerance) << c;
}

/// Every proper prefix must be rejected; files with a flipped byte must be read or rejected.
inline void expect_robust(const std::string& file) {
  for (size_t size = 0; size < file.size(); ++size) EXPECT_NE(complaint(file.substr(0, size)), "") << size;
  for (const int flip : {0x01, 0x80, 0xff})
    for (size_t i = 0; i < file.size(); ++i) {
      std::string altered = file;
      altered[i] = static_cast<char>(altered[i] ^ flip);
      (void)complaint(altered);
    }
}

inline std::string number(uint32_t value, int bytes, bool big_endian = false) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * (big_endian ? bytes - 1 - i : i));
  return text;
}

/// Pixels of a file whose alpha is below 1.
inline uint64_t transparent(const std::string& file) {
  MemoryReservation memory{MemoryBudget(kBudget)};
  return read_image(std::as_bytes(std::span(file)), true, ImageWants{.alpha = true}, memory).transparent;
}

/// Problems of a file that is read in spite of damage.
inline std::vector<std::string> problems(const std::string& file) { return read(file, true).problems; }
using Problems = std::vector<std::string>;

} // namespace packtrace::image_test
