#pragma once

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// Street and harbour furniture. Materials: "wood", "wood_dark", "iron", "lamp", "rope", "pot", "stone", "white",
/// "red", "canvas_a", "canvas_b", "cloth_a".."cloth_c", "fruit_a".."fruit_c", "leaf_light", "leaf_dark", "blossom".
Model make_crate(Random& random);        ///< 0.8 m
Model make_barrel();                     ///< 1 m
Model make_rope_coil();                  ///< 0.8 m across
Model make_bollard();                    ///< 0.6 m
Model make_lamp_post();                  ///< 4 m
Model make_bench();                      ///< 1.6 m, faces -z
Model make_flower_pot(Random& random);   ///< 0.9 m
Model make_flower_box(Random& random);   ///< 1.1 m wide, hangs on a wall at z = 0
Model make_market_stall(Random& random); ///< 2.6 m x 2 m, striped awning
Model make_cafe_table(Random& random);   ///< parasol, table, chairs; 2.6 m across
Model make_laundry(Random& random);   ///< a clothes line from x = 0 to x = 4 at y = 0, 0.45 m before a wall at z = 0.45
Model make_fish_rack(Random& random); ///< nets over poles, 3 m
Model make_buoy();                    ///< 1 m, floating
Model make_gull(Random& random);      ///< 1.2 m span, gliding
Model make_cloud(Random& random);     ///< about 20 m

} // namespace packtrace::scenegen
