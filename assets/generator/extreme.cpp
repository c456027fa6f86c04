#include "assets/generator/extreme.h"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "assets/generator/masonry.h"
#include "assets/generator/placement.h"
#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

constexpr const char* kExtremeComment =
    "# Extremes of scale in one scene: a crumb of 1e-6 before a mountain of 1e6, both the "
    "same mesh, on one ground of 4e6;\n"
    "# a cluster 1e7 away; slabs without thickness; needles 1e7 times longer than wide.\n"
    "# To be seen: crumbs resting on the ground at the left, paper-thin slabs leaning at "
    "the right, the mountain on the horizon.\n"
    "# Made by packtrace_scenegen extreme.\n\n";

/// A rectangle in the frame's xy plane, stored twice back to back: two coincident faces without volume.
Model make_slab() {
  Model model;
  Mesh& mesh = model.flat("slab");
  add_quad(mesh, {-1, 0, 0}, {-1, 2, 0}, {1, 2, 0}, {1, 0, 0});
  add_quad(mesh, {1, 0, 0}, {1, 2, 0}, {-1, 2, 0}, {-1, 0, 0});
  return model;
}

/// A box squeezed to zero height: its top and bottom coincide and its sides have no area.
Model make_flat_box() {
  Model model;
  add_box(model.flat("slab"), DAffine(1.0), {-1, 0, -1}, {1, 0, 1});
  return model;
}

/// A fan of needles from one point, each 1 long and 1e-7 wide.
Model make_needles(Random& random) {
  Model model;
  for (int i = 0; i < 64; ++i) {
    DVec3 direction = random_direction(random);
    direction.y = std::abs(direction.y);
    const DVec3 side = along(DVec3(0.0), direction)[0] * 0.5e-7;
    add_triangle(model.flat("needle"), -side, direction, side);
  }
  return model;
}

} // namespace

SceneTotals generate_extreme(const ExtremeConfig& config, const OutputConfig& output) {
  // Eye 2e-6 above the ground, crumbs 5e-6 ahead; lengths in units of the scene.
  const ViewConfig view{{0.0, 2.2e-6, -8e-6}, {0.2e-6, 1.6e-6, 0.0}, 45.0, 1280, 720};
  SceneWriter writer(output, "extreme", kExtremeComment, view);
  const std::pair<const char*, Vec3> paints[] = {{"ground", {0.55f, 0.50f, 0.42f}},
                                                 {"boulder", {0.60f, 0.36f, 0.24f}},
                                                 {"snow", {0.80f, 0.83f, 0.88f}},
                                                 {"slab", {0.25f, 0.45f, 0.60f}},
                                                 {"needle", {0.85f, 0.70f, 0.20f}}};
  for (const auto& [name, albedo] : paints) writer.material(name, albedo);

  Random random(config.seed, 300);
  writer.object("boulder", make_rock("boulder", random));
  writer.object("mountain", "boulder", {{"boulder", "snow"}});
  writer.object("slab", make_slab());
  writer.object("flat_box", make_flat_box());
  writer.object("needles", make_needles(random));
  Model ground;
  add_quad(ground.flat("ground"), {-2e6, 0, -2e6}, {-2e6, 0, 2e6}, {2e6, 0, 2e6}, {2e6, 0, -2e6});
  writer.model("ground", ground);
  writer.world_shape("ground");

  for (int i = 0; i < 24; ++i) { // crumbs around the origin, where floats are finest
    const DVec3 at{random.uniform(-4e-6, 0.5e-6), 0.0, random.uniform(-1.5e-6, 4e-6)};
    const double size = random.uniform(0.4e-6, 1.2e-6), turn = random.uniform(0.0, 6.0);
    writer.instance("boulder", stand_at(at, turn, size));
  }
  for (int i = 0; i < 5; ++i) {
    const DAffine lean = compose(translation({(1.2 + 0.55 * i) * 1e-6, 0.0, 0.4e-6 * i}),
                                 compose(rotation_y(0.5), rotation_x(0.12 * i)));
    writer.instance("slab", compose(lean, scaling(DVec3(0.5e-6, 0.9e-6, 1.0))));
  }
  writer.instance("flat_box", stand_at({0.6e-6, 0.3e-6, -1.2e-6}, 0.4, 0.4e-6));
  writer.instance("needles", stand_at({-0.6e-6, 0.0, -2.4e-6}, 0.0, 0.9e-6));
  writer.instance("mountain", stand_at({-3e5, -1e5, 1.6e6}, 0.7, 1e6));
  writer.instance("boulder", stand_at({7e5, 0.0, 1.4e6}, 2.0, 2e5));
  for (int i = 0; i < 24; ++i) { // outside the view, but inside the scene's bounds
    const DVec3 at{1e7 + random.uniform(-40.0, 40.0), random.uniform(0.0, 20.0), 1e7 + random.uniform(-40.0, 40.0)};
    const double size = random.uniform(1.0, 9.0), turn = random.uniform(0.0, 6.0);
    writer.instance(i % 2 == 0 ? "boulder" : "needles", stand_at(at, turn, size));
  }
  return writer.finish();
}

} // namespace packtrace::scenegen
