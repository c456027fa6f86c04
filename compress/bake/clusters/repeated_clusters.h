#pragma once

#include <cstdint>

namespace packtrace {

/// Which regular grids become blocks of quads (regular_blocks.h).
enum class GridBlocks : uint8_t {
  kNone,
  kMostly, ///< grids that blocks of 64 quads cover to three fifths; best for codec small
  kPartly  ///< grids that blocks of 64 or 32 quads cover to three tenths; best for codec fast
};

} // namespace packtrace
