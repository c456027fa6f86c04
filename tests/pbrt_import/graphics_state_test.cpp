#include "pbrt_import/language/graphics_state.h"

#include <cstring>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "pbrt_import/language/transforms.h"

namespace packtrace {
namespace {

void expect_near(DVec3 actual, DVec3 expected) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(actual[axis], expected[axis], 1e-12) << "axis " << axis;
}

TEST(Transforms, RotationTurnsYTowardsZAroundX) {
  const DAffine map = *rotation(90.0, {2, 0, 0});
  EXPECT_EQ(transform_point(map, DVec3(0, 1, 0)), DVec3(0, 0, 1)); // exactly
  expect_near(transform_point(*rotation(30.0, {0, 0, 1}), DVec3(1, 0, 0)), {std::numbers::sqrt3 / 2, 0.5, 0});
}

TEST(Transforms, RotationIsIndependentOfFullTurns) {
  expect_near(transform_point(*rotation(-330.0, {1, 2, 3}), DVec3(1, 0, 0)),
              transform_point(*rotation(30.0, {1, 2, 3}), DVec3(1, 0, 0)));
  EXPECT_EQ(transform_point(*rotation(-90.0, {0, 0, 1}), DVec3(0, 1, 0)), DVec3(1, 0, 0));
}

TEST(Transforms, RotationNeedsAnAxis) { EXPECT_FALSE(rotation(30.0, DVec3(0.0)).has_value()); }

TEST(Transforms, LookAtPutsTheTargetOnTheZAxis) {
  const DAffine camera_from_world = inverse(*look_at({400, 20, 30}, {0, 63, -110}, {0, 0, 1}));
  EXPECT_NEAR(glm::length(transform_point(camera_from_world, DVec3(400, 20, 30))), 0.0, 1e-9);
  const DVec3 target = transform_point(camera_from_world, DVec3(0, 63, -110));
  EXPECT_NEAR(target.x, 0.0, 1e-9);
  EXPECT_NEAR(target.y, 0.0, 1e-9);
  EXPECT_GT(target.z, 0.0);
  EXPECT_GT(transform_vector(camera_from_world, DVec3(0, 0, 1)).y, 0.0); // the up direction is kept
}

TEST(Transforms, LookAtIsLeftHanded) {
  // If +z is forward and +y is up, +x points right in pbrt.
  expect_near(transform_vector(*look_at({0, 0, 0}, {0, 0, 5}, {0, 1, 0}), DVec3(1, 0, 0)), {1, 0, 0});
}

TEST(Transforms, LookAtRejectsDegenerateViews) {
  EXPECT_FALSE(look_at({1, 1, 1}, {1, 1, 1}, {0, 1, 0}));
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 5, 0}, {0, 1, 0}));
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 5, 0}, {0, 0, 0}));
}

TEST(Transforms, MatricesAreColumnMajorAndAffine) {
  const double columns[16] = {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, 11, 12, 13, 1};
  const DAffine map = *affine_from_columns(columns);
  EXPECT_EQ(transform_point(map, DVec3(1, 0, 0)), DVec3(12, 14, 16));
  double halved[16];
  std::copy(columns, columns + 16, halved);
  halved[15] = 2;
  EXPECT_EQ(transform_point(*affine_from_columns(halved), DVec3(1, 0, 0)), DVec3(6, 7, 8));
  double projective[16];
  std::copy(columns, columns + 16, projective);
  projective[11] = 1;
  EXPECT_FALSE(affine_from_columns(projective));
  projective[11] = 0, projective[15] = 0;
  EXPECT_FALSE(affine_from_columns(projective));
}

TEST(Transforms, FlatMapsHaveNoInverse) {
  EXPECT_FALSE(is_invertible(scaling({1, 1, 0})));
  EXPECT_FALSE(is_invertible(scaling({1e-200, 1e-200, 1})));
  EXPECT_TRUE(is_invertible(scaling({1, 1, -1e-30})));
}

TEST(GraphicsState, LaterTransformsApplyFirst) {
  GraphicsState state;
  state.concatenate(translation({1, 0, 0}));
  state.concatenate(scaling({2, 2, 2}));
  EXPECT_EQ(transform_point(state.transform().start, DVec3(1, 1, 1)), DVec3(3, 2, 2));
}

TEST(GraphicsState, AttributeBlocksGiveBackEverything) {
  GraphicsState state;
  state.named_materials.define("a", 1);
  state.open_block(BlockKind::kAttribute, {});
  state.attributes.material = 5;
  state.attributes.reverse_orientation = true;
  state.named_materials.define("a", 2);
  state.named_materials.define("b", 3);
  state.float_textures.define("t", 4);
  state.concatenate(translation({1, 2, 3}));
  state.close_block();
  EXPECT_EQ(state.attributes.material, kNone);
  EXPECT_FALSE(state.attributes.reverse_orientation);
  EXPECT_EQ(state.named_materials.find("a"), 1u);
  EXPECT_EQ(state.named_materials.find("b"), std::nullopt);
  EXPECT_EQ(state.float_textures.find("t"), std::nullopt);
  EXPECT_EQ(state.transform().start[3], DVec3(0.0));
}

TEST(GraphicsState, TransformBlocksGiveBackTransformsOnly) {
  GraphicsState state;
  state.open_block(BlockKind::kTransform, {});
  state.attributes.material = 5;
  state.named_materials.define("a", 2);
  state.set_active(1);
  state.concatenate(translation({1, 2, 3}));
  state.close_block();
  EXPECT_EQ(state.attributes.material, 5u);
  EXPECT_EQ(state.named_materials.find("a"), 2u);
  EXPECT_EQ(state.transform().start[3], DVec3(0.0));
  state.concatenate(translation({1, 2, 3})); // both transforms are active again
  EXPECT_EQ(state.transform().end[3], DVec3(1, 2, 3));
}

TEST(GraphicsState, NestedRedefinitionsUnwindInOrder) {
  ScopedNames names;
  names.define("x", 0);
  const size_t outer = names.mark();
  names.define("x", 1);
  const size_t inner = names.mark();
  names.define("x", 2);
  names.define("x", 3);
  EXPECT_EQ(names.find("x"), 3u);
  names.restore(inner);
  EXPECT_EQ(names.find("x"), 1u);
  names.restore(outer);
  EXPECT_EQ(names.find("x"), 0u);
}

TEST(GraphicsState, ActiveTransformsMoveApart) {
  GraphicsState state;
  EXPECT_FALSE(state.animated());
  state.set_active(2);
  state.concatenate(translation({1, 0, 0}));
  EXPECT_TRUE(state.animated());
  EXPECT_EQ(state.transform().start[3], DVec3(0.0));
  EXPECT_EQ(state.transform().end[3], DVec3(1, 0, 0));
}

TEST(GraphicsState, MisspelledNamesFindTheirNeighbour) {
  ScopedNames names;
  names.define("RoofTiles", 0);
  names.define("Chrome", 1);
  EXPECT_EQ(names.closest("RoofTile"), "RoofTiles");
  EXPECT_EQ(names.closest("chrome"), "Chrome");
  EXPECT_EQ(names.closest("Gold"), "");
}

/// The state's transform after Transform(map) and a translation, either by its short way or as a product.
DAffine moved(const DAffine& map, DVec3 offset, bool as_product) {
  GraphicsState state;
  state.set_transform(map);
  if (as_product)
    state.concatenate(translation(offset));
  else
    state.translate(offset);
  return state.transform().end;
}

TEST(GraphicsState, TranslationsEqualProductsBitForBit) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const double a : {1.0, -0.0, 0.0, -3.5, 1e-310, inf, std::nan("")})
    for (const double b : {0.0, -0.0, -1.0, 2e200})
      for (const DVec3 offset : {DVec3(0.1, -2, 3e9), DVec3(-0.0, 0.0, -0.0), DVec3(1e300, 1e300, -1e300)}) {
        const DAffine map(DVec3(a, b, -b), DVec3(b, a, b), DVec3(-b, b, -a), DVec3(b, 5, -a));
        const DAffine fast = moved(map, offset, false), product = moved(map, offset, true);
        for (int column = 0; column < 4; ++column)
          for (int row = 0; row < 3; ++row) {
            const double x = fast[column][row], y = product[column][row];
            EXPECT_TRUE(std::memcmp(&x, &y, sizeof x) == 0 || (std::isnan(x) && std::isnan(y)))
                << a << " " << b << " column " << column << " row " << row << ": " << x << ", " << y;
          }
      }
}

TEST(GraphicsState, ActiveTransformStartsFromTheTransformsOfAllBlocks) {
  GraphicsState state;
  state.translate({1, 0, 0});
  state.open_block(BlockKind::kAttribute, {});
  state.translate({0, 2, 0});
  state.set_active(1);
  state.translate({0, 0, 3});
  EXPECT_EQ(state.transform().start[3], DVec3(1, 2, 3));
  EXPECT_EQ(state.transform().end[3], DVec3(1, 2, 0));
  state.close_block();
  EXPECT_EQ(state.transform().start[3], DVec3(1, 0, 0));
  EXPECT_EQ(state.transform().end[3], DVec3(1, 0, 0));
  EXPECT_FALSE(state.animated());
}

} // namespace
} // namespace packtrace
