#pragma once

#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Smallest and largest lattice coordinates of something; both ends are inside.
struct LatticeBox {
  LatticePoint lo{}, hi{};
};

} // namespace packtrace
