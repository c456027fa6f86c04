#pragma once

#include <cstdint>

namespace packtrace {

/// Which regular grids become blocks of quads (regular_blocks.h).
enum class GridBlocks : uint8_t {
  kNone,
  kMostly, ///< those of which blocks of up to 64 quads hold at least three fifths; best for codec small
  kPartly  ///< those of which blocks of up to 64 or 32 quads hold at least three tenths; best for codec fast
};

} // namespace packtrace
