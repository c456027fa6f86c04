#pragma once

#include "compress/format/cluster/position_grid.h"

namespace packtrace {

/// Box of lattice coordinates; both ends are inside.
struct LatticeBox {
  LatticePoint lo{}, hi{};
};

} // namespace packtrace
