// Inputs that are large, and locales with decimal commas; the inputs of tests/pbrt_import/hostile are small.

#include <algorithm>
#include <clocale>
#include <ctime>
#include <locale>

#include "tests/pbrt_import/hostile_scene.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

std::string repeated(const std::string& text, size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

const std::string kTri(kTriangle);

// Large inputs

/// CPU time of an import, and its result.
struct Timed {
  double seconds = 0.0;
  Imported imported;
};
Timed timed_import(const SceneFolder& folder, const std::string& text) {
  const std::filesystem::path scene = folder.write("scene.pbrt", text);
  const std::clock_t start = std::clock();
  Imported imported = import_file(scene);
  return {static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, std::move(imported)};
}

/// Four times the input must take less than ten times as long; inputs that are too fast to measure pass.
void expect_linear(const Timed& small, const Timed& four_times) {
  constexpr double kMeasurableSeconds = 0.05;
  EXPECT_LT(four_times.seconds, 10.0 * std::max(small.seconds, kMeasurableSeconds));
}

/// Concatenates item(0) to item(count - 1).
template <class Item>
std::string listed(int count, Item item) {
  std::string all;
  for (int i = 0; i < count; ++i) all += item(i);
  return all;
}

TEST(HostileSizes, MillionParametersOnOneDirective) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(kTri + listed(count, [](int i) { return numbered("\"float p", i) + "\" 1\n"; })));
  };
  const Timed small = import(250'000), large = import(1'000'000);
  expect_linear(small, large);
  EXPECT_EQ(kept_of(large.imported), (Kept{2, 2, 0, 0}));
  EXPECT_EQ(to_string(large.imported.diagnostics.back()),
            "warning: 990000 further problems are not listed: only the first 10000 different ones are");
}

TEST(HostileSizes, SameParameterAMillionTimes) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const SceneFolder folder;
  const Timed large = timed_import(folder, world(kTri + repeated("\"float alpha\" 0 ", 999'999) + "\"float alpha\" 1"));
  EXPECT_EQ(
      without_folder(large.imported.text(), folder),
      "scene.pbrt:2:97: warning: parameter \"float alpha\" is given again; the last one counts (999999 times, first "
      "here)\n");
  EXPECT_EQ(kept_of(large.imported), (Kept{2, 2, 0, 0}));
}

TEST(HostileSizes, TwentyThousandObjectsThatAreNeverInstanced) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, listed(20'000, [](int i) { return numbered("ObjectBegin \"o", i) + "\"" + kTri + "ObjectEnd\n"; }));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:1:12: warning: object \"o0\" and 19999 more are never instanced: left out\n");
}

TEST(HostileSizes, HundredThousandUnknownDirectives) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(listed(count, [](int i) { return numbered("Nonsense", i) + " Identity\n"; })));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(large.imported.count(Severity::kError), 10'001u);
  EXPECT_EQ(to_string(large.imported.diagnostics.back()),
            "error: 90000 further problems are not listed: only the first 10000 different ones are");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, HundredThousandCrossedBlocks) {
  const SceneFolder folder;
  const auto import = [&](size_t count) {
    return timed_import(folder, world(repeated("AttributeBegin TransformBegin\nAttributeEnd\n", count)));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(
      without_folder(to_string(large.imported.diagnostics.front()), folder),
      "scene.pbrt:3:1: error: AttributeEnd closes the TransformBegin at scene.pbrt:2:16, which has no TransformEnd "
      "before it");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, HundredThousandUnknownMaterials) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(listed(count, [](int i) { return numbered("Material \"matte", i) + "\"\n"; })));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.front()), folder),
            "scene.pbrt:2:1: error: unknown material \"matte0\"; matte is used; did you mean \"matte\"?");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, ThousandsOfUnknownNamedMaterialsAmongThousands) {
  const SceneFolder folder;
  const auto import = [&](int unknown, int defined) {
    return timed_import(
        folder, world(listed(defined,
                             [](int i) {
                               return numbered("MakeNamedMaterial \"metal", i) + "\" \"string type\" \"metal\"\n";
                             }) +
                      listed(unknown, [](int i) { return numbered("NamedMaterial \"metl", i) + "\"\n"; })));
  };
  const Timed small = import(1000, 2250), large = import(4000, 9000);
  expect_linear(small, large);
  ASSERT_EQ(large.imported.diagnostics.size(), 4000u);
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.front()), folder),
            "scene.pbrt:9002:1: error: no named material \"metl0\"; the material before it stays; did you mean "
            "\"metal0\"?");
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.back()), folder), // no hints after too many comparisons
            "scene.pbrt:13001:1: error: no named material \"metl3999\"; the material before it stays");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, FileNameOfAHundredThousandFolders) {
  const SceneFolder folder;
  const auto import = [&](size_t count) {
    return timed_import(folder, world("Include \"" + repeated("a/../b/", count) + "x\""));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  ASSERT_EQ(large.imported.diagnostics.size(), 1u);
  EXPECT_TRUE(large.imported.diagnostics[0].message.ends_with("...\": cannot open: File name too long"));
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

// Locales

class DecimalComma : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// Sets C++'s global locale to decimal commas, and C's if such a locale is installed, during its lifetime.
class CommaLocale {
public:
  CommaLocale()
      : before_(std::locale::global(std::locale(std::locale::classic(), new DecimalComma))),
        c_before_(std::setlocale(LC_ALL, nullptr)) {
    for (const char* const name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8", "es_ES.UTF-8"})
      if (std::setlocale(LC_ALL, name)) break;
  }
  ~CommaLocale() {
    std::locale::global(before_);
    std::setlocale(LC_ALL, c_before_.c_str());
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

private:
  std::locale before_;
  std::string c_before_;
};

TEST(HostileLocales, DecimalCommasChangeNothing) {
  const SceneFolder folder;
  folder.write("a.ply", kPly);
  folder.write("a.spd", "400 0.5 700 0.25");
  const std::string text =
      world("Scale 1.5 1.5 1.5 Material \"matte\" \"spectrum Kd\" \"a.spd\"\n" + ply_shape("a.ply") +
            "Texture \"t\" \"float\" \"constant\" \"float value\" 1.5e400\n" + repeated("AttributeEnd\n", 1234));
  const Imported plain = import_text(folder, text);
  const CommaLocale comma;
  const Imported imported = import_text(folder, text);
  EXPECT_EQ(imported.text(), plain.text());
  EXPECT_TRUE(imported.reported("(1234 times, first here)")) << imported.text();
  EXPECT_EQ(imported.scene.materials[0].albedo, plain.scene.materials[0].albedo);
  ASSERT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 1), DVec3(1.5, 0, 0));
}

} // namespace
} // namespace packtrace
