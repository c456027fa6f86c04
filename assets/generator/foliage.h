#pragma once

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// Plants with real leaf geometry. Materials: "bark", "leaf_light", "leaf_dark", "cypress", "olive", "pine", "palm",
/// "blossom". `detail` scales the number of leaves: 1 suits a tree that is 100 pixels tall.
Model make_broadleaf(Random& random, double detail);     ///< about 6 m
Model make_cypress(Random& random, double detail);       ///< about 8 m, narrow
Model make_umbrella_pine(Random& random, double detail); ///< about 9 m
Model make_olive(Random& random, double detail);         ///< about 4 m
Model make_conifer(Random& random, double detail);       ///< about 12 m, for forests
Model make_palm(Random& random, double detail);          ///< about 7 m
Model make_bush(Random& random, double detail);          ///< about 1 m
Model make_blossom_bush(Random& random, double detail);  ///< about 1.5 m, climbing
Model make_grass_tuft(Random& random, double detail);    ///< about 0.5 m

} // namespace packtrace::scenegen
