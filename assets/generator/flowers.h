#pragma once

#include "assets/generator/model.h"
#include "assets/generator/random.h"

namespace packtrace::scenegen {

/// Meadow flowers on thin stems, about 0.6 m tall. Materials: "stem", and "poppy", "daisy" and "daisy_eye", or
/// "cornflower".
Model make_poppy(Random& random);
Model make_daisy(Random& random);
Model make_cornflower(Random& random);

} // namespace packtrace::scenegen
