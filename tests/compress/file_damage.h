#pragma once

#include <array>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <xxhash.h>

#include "compress/format/baked_file.h"
#include "pbrt_import/scene/error.h"

namespace packtrace::test {

/// The kind of error that opening a file ends with, which must be one.
inline ErrorKind open_kind(std::span<const std::byte> bytes, std::string* message = nullptr) {
  try {
    (void)BakedFile::from_bytes(bytes);
  } catch (const Error& error) {
    if (message) *message = error.what();
    return error.kind();
  }
  ADD_FAILURE() << "the file was accepted";
  return ErrorKind::kCancelled;
}

/// Makes the hashes right again, so that damage reaches the checks behind them.
inline void rehash(std::vector<std::byte>& bytes) {
  const XXH128_hash_t hash =
      XXH3_128bits(bytes.data() + sizeof(baked::FileHeader), bytes.size() - sizeof(baked::FileHeader));
  const std::array<uint64_t, 2> content = {hash.low64, hash.high64};
  std::memcpy(bytes.data() + offsetof(baked::FileHeader, content_hash), content.data(), sizeof content);
  const uint64_t header = XXH3_64bits(bytes.data(), offsetof(baked::FileHeader, header_hash));
  std::memcpy(bytes.data() + offsetof(baked::FileHeader, header_hash), &header, sizeof header);
}

/// Changes one u32 of a file and returns what opening it says.
inline std::string message_after(std::vector<std::byte> bytes, baked::Section section, size_t at, uint32_t value) {
  baked::FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  std::memcpy(bytes.data() + header.sections[section].offset + at, &value, sizeof value);
  rehash(bytes);
  std::string message;
  EXPECT_EQ(open_kind(bytes, &message), ErrorKind::kInput);
  return message;
}

} // namespace packtrace::test
