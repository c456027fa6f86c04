#include "pbrt_import/language/parameters.h"

#include <array>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

Parameter number(std::string name, const std::vector<float>& values) {
  Parameter parameter;
  parameter.type = ParameterType::kFloat;
  parameter.name = std::move(name);
  parameter.floats = FloatArray(values);
  return parameter;
}

void add(ParameterList& list, Parameter parameter) {
  list.append() = std::move(parameter);
  list.keep();
}

std::string parameter_name(int number) { return std::string("p").append(std::to_string(number)); }

TEST(Parameters, SynonymsAreTheSameType) {
  EXPECT_EQ(parameter_type("color"), parameter_type("rgb"));
  EXPECT_EQ(parameter_type("point"), parameter_type("point3"));
  EXPECT_EQ(parameter_type("vector"), parameter_type("vector3"));
  EXPECT_EQ(parameter_type("colour"), std::nullopt);
}

TEST(Parameters, LastOfTheSameNameAndTypeWins) {
  ParameterList list;
  add(list, number("radius", {1}));
  add(list, number("radius", {2}));
  EXPECT_EQ(list.get_float("radius", 0), 2);
  EXPECT_EQ(list.all().size(), 1u);
}

TEST(Parameters, LastWinsInVeryLongListsToo) {
  ParameterList list;
  for (int i = 0; i < 100; ++i) add(list, number(parameter_name(i % 50), {static_cast<float>(i)}));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(list.get_float(parameter_name(i), -1), static_cast<float>(50 + i));
}

TEST(Parameters, WrongCountGivesTheDefaultAndStaysUnused) {
  ParameterList list;
  add(list, number("radius", {1, 2}));
  EXPECT_EQ(list.get_float("radius", 7), 7);
  EXPECT_FALSE(list.all()[0].used);
}

TEST(Parameters, WrongTypeGivesTheDefaultAndStaysUnused) {
  ParameterList list;
  add(list, number("levels", {2}));
  EXPECT_EQ(list.get_integer("levels", 3), 3);
  EXPECT_FALSE(list.all()[0].used);
  EXPECT_TRUE(list.was_looked_up("levels"));
}

TEST(Parameters, TakingMovesTheValuesOut) {
  ParameterList list;
  add(list, number("x", {1, 2, 3}));
  EXPECT_EQ(list.take_vectors("x", ParameterType::kFloat), (std::vector<Vec3>{{1, 2, 3}}));
  EXPECT_TRUE(list.take_vectors("x", ParameterType::kFloat).empty());
  EXPECT_TRUE(list.take_vectors("x", ParameterType::kPoint3).empty());
}

TEST(ClosestName, FindsTyposButNotOtherWords) {
  const std::array<std::string_view, 5> names = {"radius", "zmin", "zmax", "Kd", "filename"};
  EXPECT_EQ(closest_name("radus", names), "radius");
  EXPECT_EQ(closest_name("fileName", names), "filename");
  EXPECT_EQ(closest_name("kd", names), "Kd");
  EXPECT_EQ(closest_name("Ks", names), "");
  EXPECT_EQ(closest_name("roughness", names), "");
  EXPECT_EQ(closest_name("", names), "");
  EXPECT_EQ(closest_name(std::string(100'000, 'x'), names), "");
}

/// Appends and keeps a parameter with one value.
void append(ParameterList& list, std::string name, float value) {
  Parameter& parameter = list.append();
  parameter.type = ParameterType::kFloat;
  parameter.name = std::move(name);
  parameter.floats.push_back(value);
  list.keep();
}

TEST(ParameterList, ReusedParametersStartWithoutValues) {
  ParameterList list;
  append(list, "a", 1.0f);
  list.last().strings.emplace_back("text");
  EXPECT_EQ(list.get_float("b", 5.0f), 5.0f);
  list.clear();
  EXPECT_TRUE(list.empty());
  EXPECT_EQ(list.find("a", {ParameterType::kFloat}), nullptr);
  const Parameter& again = list.append();
  EXPECT_TRUE(again.floats.empty() && again.integers.empty() && again.strings.empty() && !again.used);
}

TEST(ParameterList, CopiesAndMovesHaveTheirOwnParameters) {
  ParameterList list;
  append(list, "dropped", 0.0f);
  list.clear();
  append(list, "a", 1.0f);
  append(list, "b", 2.0f);
  append(list, "a", 3.0f); // replaces the first
  ParameterList copy = list;
  EXPECT_EQ(copy.all().size(), 2u);
  EXPECT_EQ(copy.get_float("a", 0.0f), 3.0f);
  const ParameterList moved = std::move(list);
  EXPECT_EQ(moved.get_float("b", 0.0f), 2.0f);
  list = {};
  append(list, "c", 4.0f);
  EXPECT_EQ(list.all().size(), 1u);
  copy = list;
  EXPECT_EQ(copy.get_float("c", 0.0f), 4.0f);
  EXPECT_EQ(copy.get_float("a", 0.0f), 0.0f);
  EXPECT_EQ(moved.all().size(), 2u);
}

} // namespace
} // namespace packtrace
