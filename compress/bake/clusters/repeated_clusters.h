#pragma once

#include <cstdint>

namespace packtrace {

/// Which clusters are cut alike, so that a compressed page stores once what they have in common: blocks of quads in
/// regular grids (regular_blocks.h) and parts of a mesh that repeat (repeated_parts.h).
enum class RepeatedClusters : uint8_t {
  kNone,
  kMany, ///< parts, and blocks of 64 quads where these cover three fifths of a grid; best for codec small
  kMost  ///< parts, and blocks of 64 or 32 quads where these cover three tenths of a grid; best for codec fast
};

} // namespace packtrace
