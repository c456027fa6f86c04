#include "assets/generator/facade.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "assets/generator/primitives.h"

namespace packtrace::scenegen {
namespace {

constexpr double kReveal = 0.22; ///< depth of panes behind the wall's face
constexpr uint32_t kArchSegments = 10;

/// Quad facing -z of the frame.
void add_panel(Mesh& mesh, const DAffine& frame, double x0, double y0, double x1, double y1, double z) {
  add_quad(mesh, transform_point(frame, {x0, y0, z}), transform_point(frame, {x0, y1, z}),
           transform_point(frame, {x1, y1, z}), transform_point(frame, {x1, y0, z}));
}

/// The wall between the openings: the grid of all their edges, without the cells inside an opening.
void add_wall(Mesh& mesh, const DAffine& frame, double width, double height, std::span<const Opening> openings) {
  std::vector<double> xs{0.0, width}, ys{0.0, height};
  for (const Opening& o : openings) xs.insert(xs.end(), {o.x0, o.x1}), ys.insert(ys.end(), {o.y0, o.y1});
  for (std::vector<double>* cuts : {&xs, &ys}) {
    std::sort(cuts->begin(), cuts->end());
    cuts->erase(std::unique(cuts->begin(), cuts->end()), cuts->end());
  }
  const auto open = [&](double x, double y) {
    return std::any_of(openings.begin(), openings.end(),
                       [&](const Opening& o) { return o.x0 < x && x < o.x1 && o.y0 < y && y < o.y1; });
  };
  for (size_t j = 0; j + 1 < ys.size(); ++j) {
    const double y = (ys[j] + ys[j + 1]) * 0.5;
    for (size_t i = 0; i + 1 < xs.size();) {
      size_t end = i + 1; // the longest run of wall in this row becomes one quad
      if (open((xs[i] + xs[end]) * 0.5, y)) {
        i = end;
        continue;
      }
      while (end + 1 < xs.size() && !open((xs[end] + xs[end + 1]) * 0.5, y)) ++end;
      add_panel(mesh, frame, xs[i], ys[j], xs[end], ys[j + 1], 0.0);
      i = end;
    }
  }
}

/// The four inner sides of a rectangular hole.
void add_reveal(Mesh& mesh, const DAffine& f, const Opening& o, double depth) {
  const DVec3 corners[] = {{o.x0, o.y0, 0}, {o.x1, o.y0, 0}, {o.x1, o.y1, 0}, {o.x0, o.y1, 0}};
  for (size_t i = 0; i < 4; ++i) {
    const DVec3 a = corners[i], b = corners[(i + 1) % 4], back(0, 0, depth);
    add_quad(mesh, transform_point(f, a), transform_point(f, a + back), transform_point(f, b + back),
             transform_point(f, b));
  }
}

void add_panes(Model& model, const DAffine& f, const Opening& o) {
  add_panel(model.flat(o.lit ? "lamp" : "glass"), f, o.x0, o.y0, o.x1, o.y1, kReveal);
  Mesh& trim = model.flat("trim");
  const double bar = 0.06, front = kReveal - 0.07, back = kReveal, middle = (o.x0 + o.x1) * 0.5;
  add_box(trim, f, {o.x0, o.y0, front}, {o.x0 + bar, o.y1, back});
  add_box(trim, f, {o.x1 - bar, o.y0, front}, {o.x1, o.y1, back});
  add_box(trim, f, {o.x0 + bar, o.y1 - bar, front}, {o.x1 - bar, o.y1, back});
  add_box(trim, f, {o.x0 + bar, o.y0, front}, {o.x1 - bar, o.y0 + bar, back});
  add_box(trim, f, {middle - 0.03, o.y0 + bar, front}, {middle + 0.03, o.y1 - bar, back});
  const double cross = mix(o.y0, o.y1, 0.62);
  add_box(trim, f, {o.x0 + bar, cross - 0.03, front + 0.02}, {o.x1 - bar, cross + 0.03, back});
}

void add_shutters(Model& model, const DAffine& f, const Opening& o) {
  Mesh& mesh = model.flat("shutter");
  const double leaf = (o.x1 - o.x0) * 0.5;
  for (const double x : {o.x0 - leaf - 0.03, o.x1 + 0.03}) {
    add_box(mesh, f, {x, o.y0, -0.07}, {x + leaf, o.y1, -0.02});
    for (const double t : {0.12, 0.5, 0.88}) {
      const double y = mix(o.y0, o.y1, t);
      add_box(mesh, f, {x + 0.03, y - 0.05, -0.1}, {x + leaf - 0.03, y + 0.05, -0.07});
    }
  }
}

void add_window(Model& model, const DAffine& f, const Opening& o) {
  add_reveal(model.flat("wall"), f, o, kReveal);
  add_panes(model, f, o);
  if (o.kind == OpeningKind::kBalconyDoor) return;
  add_box(model.flat("stone"), f, {o.x0 - 0.12, o.y0 - 0.1, -0.14}, {o.x1 + 0.12, o.y0, 0.02});
  if (o.kind == OpeningKind::kShutteredWindow)
    add_shutters(model, f, o);
  else
    add_box(model.flat("stone"), f, {o.x0 - 0.1, o.y1, -0.07}, {o.x1 + 0.1, o.y1 + 0.16, 0.02});
}

void add_door(Model& model, const DAffine& f, const Opening& o) {
  add_reveal(model.flat("wall"), f, o, kReveal);
  Mesh& door = model.flat("door");
  add_panel(door, f, o.x0, o.y0, o.x1, o.y1, kReveal);
  const double middle = (o.x0 + o.x1) * 0.5;
  for (const double x : {o.x0 + 0.1, middle + 0.04}) {
    for (const double t : {0.06, 0.52}) {
      const double y = mix(o.y0, o.y1, t);
      add_box(door, f, {x, y, kReveal - 0.05}, {x + (o.x1 - o.x0) * 0.5 - 0.14, y + (o.y1 - o.y0) * 0.4, kReveal});
    }
  }
  Mesh& stone = model.flat("stone");
  add_box(stone, f, {o.x0 - 0.18, o.y0, -0.06}, {o.x0, o.y1, 0.03});
  add_box(stone, f, {o.x1, o.y0, -0.06}, {o.x1 + 0.18, o.y1, 0.03});
  add_box(stone, f, {o.x0 - 0.24, o.y1, -0.1}, {o.x1 + 0.24, o.y1 + 0.2, 0.03});
  add_box(stone, f, {o.x0 - 0.25, -0.3, -0.75}, {o.x1 + 0.25, 0.12, 0.0});
  add_box(stone, f, {o.x0 - 0.1, 0.12, -0.4}, {o.x1 + 0.1, o.y0, 0.0});
}

/// A half circle at the top of the opening, with its stones; the wall above it is filled in.
void add_arch(Model& model, const DAffine& f, const Opening& o, double depth) {
  const double radius = (o.x1 - o.x0) * 0.5, centre = o.x0 + radius, spring = o.y1 - radius;
  Mesh& wall = model.flat("wall");
  Mesh& stone = model.flat("stone");
  const auto on_circle = [&](uint32_t i, double r, double z) {
    const auto [s, c] = sin_cos(kPi * i / kArchSegments);
    return transform_point(f, {centre - r * c, spring + r * s, z});
  };
  for (uint32_t i = 0; i < kArchSegments; ++i) {
    const double xa = centre - radius * sin_cos(kPi * i / kArchSegments).cos;
    const double xb = centre - radius * sin_cos(kPi * (i + 1) / kArchSegments).cos;
    add_quad(wall, on_circle(i, radius, 0), transform_point(f, {xa, o.y1, 0}), transform_point(f, {xb, o.y1, 0}),
             on_circle(i + 1, radius, 0));
    add_quad(wall, on_circle(i, radius, 0), on_circle(i + 1, radius, 0), on_circle(i + 1, radius, depth),
             on_circle(i, radius, depth));
    const double rim = radius + 0.2; // voussoirs protrude from the wall
    add_quad(stone, on_circle(i, radius, -0.06), on_circle(i, rim, -0.06), on_circle(i + 1, rim, -0.06),
             on_circle(i + 1, radius, -0.06));
    add_quad(stone, on_circle(i, rim, -0.06), on_circle(i, rim, 0), on_circle(i + 1, rim, 0),
             on_circle(i + 1, rim, -0.06));
    add_quad(stone, on_circle(i, radius, 0), on_circle(i, radius, -0.06), on_circle(i + 1, radius, -0.06),
             on_circle(i + 1, radius, 0));
  }
  for (const double x : {o.x0, o.x1}) {
    const double side = x == o.x0 ? 1.0 : -1.0;
    const DVec3 a(x, o.y0, side > 0 ? 0 : depth), b(x, o.y0, side > 0 ? depth : 0);
    add_quad(wall, transform_point(f, a), transform_point(f, DVec3(x, spring, a.z)),
             transform_point(f, DVec3(x, spring, b.z)), transform_point(f, b));
    const double outer = x - side * 0.2;
    add_box(stone, f, {std::min(x, outer), o.y0, -0.06}, {std::max(x, outer), spring, 0.0});
  }
}

} // namespace

void add_facade(Model& model, const DAffine& frame, double width, double height, std::span<const Opening> openings) {
  add_wall(model.flat("wall"), frame, width, height, openings);
  for (const Opening& o : openings) {
    switch (o.kind) {
    case OpeningKind::kWindow:
    case OpeningKind::kShutteredWindow:
    case OpeningKind::kBalconyDoor:
      add_window(model, frame, o);
      break;
    case OpeningKind::kDoor:
      add_door(model, frame, o);
      break;
    case OpeningKind::kArch:
      add_arch(model, frame, o, 0.4);
      break;
    case OpeningKind::kRecess:
      add_reveal(model.flat("wall"), frame, o, 0.5);
      add_panel(model.flat("glass"), frame, o.x0, o.y0, o.x1, o.y1, 0.5);
      break;
    }
  }
}

void add_tiles(Model& model, const DAffine& frame, double width, double length, double inset, Random& random) {
  static constexpr const char* kShades[] = {"tile_a", "tile_a", "tile_b", "tile_c"};
  const double pitch = 0.4, run = 0.62;
  const auto columns = static_cast<uint32_t>(std::ceil(width / pitch)),
             rows = static_cast<uint32_t>(std::ceil(length / run));
  for (uint32_t j = 0; j < rows; ++j) {
    const double y0 = length * j / rows, y1 = std::min(length, length * (j + 1) / rows + 0.05);
    const double margin = inset * (y0 + y1) * 0.5 / length;
    for (uint32_t i = 0; i < columns; ++i) {
      Mesh& mesh = model.flat(kShades[random.below(4)]);
      const double x0 = width * i / columns, x1 = width * (i + 1) / columns;
      if (x0 < margin - 0.2 || x1 > width - margin + 0.2) continue;
      const double step = x1 - x0, lift = 0.05 + random.uniform(0.0, 0.03);
      uint32_t ring[2][4];
      for (uint32_t end = 0; end < 2; ++end) {
        const double y = end == 0 ? y0 : y1, base = end == 0 ? -lift : 0.0;
        ring[end][0] = add_vertex(mesh, transform_point(frame, {x0, y, base + 0.02}));
        ring[end][1] = add_vertex(mesh, transform_point(frame, {x0 + 0.28 * step, y, base - 0.11}));
        ring[end][2] = add_vertex(mesh, transform_point(frame, {x0 + 0.72 * step, y, base - 0.11}));
        ring[end][3] = add_vertex(mesh, transform_point(frame, {x1, y, base + 0.02}));
      }
      for (uint32_t k = 0; k < 3; ++k) add_quad(mesh, ring[0][k], ring[1][k], ring[1][k + 1], ring[0][k + 1]);
      add_quad(mesh, ring[0][0], ring[0][1], ring[0][2], ring[0][3]);
    }
  }
}

void add_railing(Model& model, std::string_view material, const DAffine& frame, double length, double height,
                 double spacing) {
  Mesh& mesh = model.flat(material);
  const auto posts = static_cast<uint32_t>(std::max(1.0, std::floor(length / spacing + 0.5)));
  for (uint32_t i = 0; i <= posts; ++i) {
    const double x = length * i / posts;
    add_box(mesh, frame, {x - 0.025, 0, -0.025}, {x + 0.025, height, 0.025});
  }
  add_box(mesh, frame, {-0.05, height - 0.03, -0.05}, {length + 0.05, height + 0.04, 0.05});
  add_box(mesh, frame, {0, 0.12, -0.03}, {length, 0.17, 0.03});
}

} // namespace packtrace::scenegen
