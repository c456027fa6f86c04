#include "assets/generator/flowers.h"

#include <string_view>

#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

/// Grows a curved stem and returns the frame of its head: y along the stem.
DAffine add_stem(Model& model, double height, Random& random) {
  const auto [s, c] = sin_cos(random.uniform(0.0, 2.0 * kPi));
  const double lean = random.uniform(0.05, 0.16);
  const DVec3 path[] = {{0, -0.05, 0}, {c * lean * 0.3, height * 0.55, s * lean * 0.3}, {c * lean, height, s * lean}};
  const double radii[] = {0.006, 0.005, 0.004};
  add_tube(model.flat("stem"), path, radii, 3);
  return along(path[2], path[2] - path[1] + random_direction(random) * 0.08);
}

/// Petals around a head, raised by `rise_rad` from the plane across the stem.
void add_petals(Model& model, std::string_view material, const DAffine& head, int count, double length, double width,
                double rise_rad, Random& random) {
  const double phase = random.uniform(0.0, 2.0 * kPi);
  for (int i = 0; i < count; ++i) {
    const auto turn = sin_cos(phase + 2.0 * kPi * i / count);
    const auto rise = sin_cos(rise_rad + random.uniform(-0.15, 0.15));
    const DVec3 direction(turn.cos * rise.cos, rise.sin, turn.sin * rise.cos), side(-turn.sin, 0.0, turn.cos);
    add_leaf(model.flat(material), transform_point(head, DVec3(0.0)), transform_vector(head, direction * length),
             transform_vector(head, side * (width * 0.5)));
  }
}

} // namespace

Model make_poppy(Random& random) {
  Model model;
  const DAffine head = add_stem(model, random.uniform(0.5, 0.62), random);
  add_petals(model, "poppy", head, 5, 0.07, 0.075, 0.75, random);
  add_petals(model, "poppy", head, 4, 0.055, 0.06, 1.1, random);
  return model;
}

Model make_daisy(Random& random) {
  Model model;
  const DAffine head = add_stem(model, random.uniform(0.46, 0.58), random);
  add_petals(model, "daisy", head, 10, 0.055, 0.024, 0.12, random);
  static constexpr glm::dvec2 kEye[] = {{0.02, 0.0}, {0.017, 0.01}, {0.0, 0.016}};
  add_lathe(model.flat("daisy_eye"), head, kEye, 6);
  return model;
}

Model make_cornflower(Random& random) {
  Model model;
  for (int stem = 0; stem < 2; ++stem) {
    const DAffine head = add_stem(model, random.uniform(0.45, 0.62), random);
    add_petals(model, "cornflower", head, 8, 0.045, 0.024, 0.45, random);
    add_petals(model, "cornflower", head, 6, 0.032, 0.02, 1.0, random);
  }
  return model;
}

} // namespace packtrace::scenegen
