// Imports the inputs in tests/pbrt_import/hostile and compares the outcome with the expectation next to each.
// With PACKTRACE_UPDATE_GOLDEN=1 in the environment, expectations that differ are rewritten, and their tests fail.

#include <cstdlib>
#include <set>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest-spi.h>

#include "tests/pbrt_import/hostile_recipe.h"
#include "tests/pbrt_import/hostile_scene.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream content;
  content << in.rdbuf();
  return content.str();
}

/// The files of an input: a scene, a PLY file that a scene refers to, or a recipe.
HostileInput read_input(const fs::path& file) {
  const std::string content = content_of(file), kind = file.extension().string();
  if (kind == ".pbrt") return {{{"scene.pbrt", content}}, {}};
  if (kind == ".ply") return {{{"scene.pbrt", world("\n" + ply_shape("m.ply"))}, {"m.ply", content}}, {}};
  if (kind == ".recipe") return parse_recipe(content);
  throw std::runtime_error(file.string() + " is neither .pbrt, .ply nor .recipe");
}

/// Imports again with ImportOptions::strict. The import must fail if and only if there was a warning or an error, with
/// the first of them as its message.
void expect_strict_agrees(ImportOptions options, const fs::path& scene, const Imported& lenient) {
  options.strict = true;
  const auto first = std::find_if(lenient.diagnostics.begin(), lenient.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity != Severity::kNote; });
  try {
    (void)import_file(scene, options);
    EXPECT_EQ(first, lenient.diagnostics.end()) << "strict mode accepted it";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    ASSERT_NE(first, lenient.diagnostics.end()) << error.what();
    EXPECT_EQ(std::string(error.what()).find(to_string(first->location) + ": " + first->message), 0u) << error.what();
  }
}

/// Imports an input, checks what must hold for each, and returns what an expectation holds: the diagnostics in order as
/// a user sees them, without the folder's path, and counts of what is kept; or the error that refuses the scene.
std::string outcome_of(const HostileInput& input) {
  const SceneFolder folder;
  for (const auto& [name, content] : input.files) folder.write(name, content);
  const fs::path scene = folder.path() / "scene.pbrt";
  try {
    const Imported imported = import_file(scene, input.options);
    expect_sound(imported.scene);
    expect_strict_agrees(input.options, scene, imported);
    std::ostringstream outcome;
    outcome << without_folder(imported.text(), folder) << "kept: " << kept_of(imported) << "\n";
    return outcome.str();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return "refused: " + without_folder(error.what(), folder) + "\n";
  }
}

/// The input of a case: the one file of this name that is no expectation. Throws std::runtime_error unless there is
/// one.
fs::path input_of(const fs::path& stem) {
  std::vector<fs::path> inputs;
  for (const char* const kind : {".pbrt", ".ply", ".recipe"})
    if (const fs::path file = stem.string() + kind; fs::exists(file)) inputs.push_back(file);
  if (inputs.empty()) throw std::runtime_error(stem.string() + ".expected has no input");
  if (inputs.size() > 1) throw std::runtime_error(stem.string() + " has several inputs");
  return inputs[0];
}

/// Compares the outcome of the case with this stem with its expectation; rewrites that first if `update` is set.
void check_case(const fs::path& stem, bool update) {
  const fs::path input = input_of(stem), expectation = stem.string() + ".expected";
  const std::string outcome = outcome_of(read_input(input));
  const bool expected = fs::exists(expectation);
  if (update && (!expected || content_of(expectation) != outcome)) {
    std::ofstream(expectation, std::ios::binary) << outcome;
    FAIL() << "rewrote " << expectation.string() << ": review the change";
  }
  ASSERT_TRUE(expected) << expectation.string() << " is missing; PACKTRACE_UPDATE_GOLDEN=1 writes it";
  EXPECT_EQ(content_of(expectation), outcome) << input.string();
}

/// A test that checks one case.
class GoldenTest : public testing::Test {
public:
  explicit GoldenTest(fs::path stem) : stem_(std::move(stem)) {}
  void TestBody() override {
    const char* const update = std::getenv("PACKTRACE_UPDATE_GOLDEN");
    check_case(stem_, update && update == std::string("1"));
  }

private:
  fs::path stem_;
};

/// "ply_headers" -> "HostilePlyHeaders"
std::string suite_of(const std::string& folder) {
  std::string suite = "Hostile";
  bool upper = true;
  for (const char c : folder) {
    if (c != '_') suite += upper ? static_cast<char>(std::toupper(c)) : c;
    upper = c == '_';
  }
  return suite;
}

/// Paths without extension of all files in the folder's subfolders: each is a case.
std::set<fs::path> stems_in(const fs::path& folder) {
  std::set<fs::path> stems;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().parent_path() != folder)
      stems.insert(fs::path(entry.path()).replace_extension());
  return stems;
}

/// Registers a test for each case.
/// @return the number of cases
size_t register_cases(const fs::path& folder) {
  const std::set<fs::path> stems = stems_in(folder);
  for (const fs::path& stem : stems)
    testing::RegisterTest(suite_of(stem.parent_path().filename().string()).c_str(), stem.filename().string().c_str(),
                          nullptr, nullptr, __FILE__, __LINE__,
                          [stem]() -> GoldenTest* { return new GoldenTest(stem); });
  return stems.size();
}

const size_t kCaseCount = register_cases(fs::path(PACKTRACE_SOURCE_DIR) / "tests/pbrt_import/hostile");

TEST(HostileGolden, TheFolderIsFound) { EXPECT_GT(kCaseCount, 500u); }

/// A folder with one case whose import reports an error.
struct GoldenFolder : SceneFolder {
  GoldenFolder() { write("suite/Case.pbrt", world("Nonsense")); }
  fs::path stem() const { return path() / "suite/Case"; }
  std::string expectation() const { return content_of(path() / "suite/Case.expected"); }
};
const char* const kOutcome =
    "scene.pbrt:2:1: error: unknown directive \"Nonsense\"\nkept: 1 shapes, 1 triangles, 0 skipped, 0 dropped\n";

TEST(HostileGolden, EqualExpectationsPass) {
  const GoldenFolder folder;
  folder.write("suite/Case.expected", kOutcome);
  check_case(folder.stem(), false);
  check_case(folder.stem(), true);
}

/// Checks a case and returns the message of its only failure.
std::string failure_of(const fs::path& stem, bool update) {
  testing::TestPartResultArray failures;
  {
    testing::ScopedFakeTestPartResultReporter reporter(
        testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &failures);
    try {
      check_case(stem, update);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  EXPECT_EQ(failures.size(), 1);
  return failures.size() == 1 ? failures.GetTestPartResult(0).message() : "";
}

TEST(HostileGolden, DifferencesFailWithADiff) {
  const GoldenFolder folder;
  folder.write("suite/Case.expected", "scene.pbrt:2:1: error\nkept: 1 shapes, 1 triangles, 0 skipped, 0 dropped\n");
  EXPECT_NE(
      failure_of(folder.stem(), false).find("\n-scene.pbrt:2:1: error\n+scene.pbrt:2:1: error: unknown directive"),
      std::string::npos);
}

TEST(HostileGolden, UpdatesFailOnceAndThenPass) {
  const GoldenFolder folder;
  folder.write("suite/Case.expected", "scene.pbrt:2:1: error\n");
  EXPECT_NE(failure_of(folder.stem(), true).find("rewrote "), std::string::npos);
  EXPECT_EQ(folder.expectation(), kOutcome);
  check_case(folder.stem(), true);
}

TEST(HostileGolden, InputsAndExpectationsComeInPairs) {
  const GoldenFolder folder;
  EXPECT_NE(failure_of(folder.stem(), false).find(" is missing"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder.path() / "suite/Case.expected"));
  folder.write("suite/Case.expected", kOutcome);
  folder.write("suite/Case.ply", kPly);
  EXPECT_NE(failure_of(folder.stem(), true).find(" has several inputs"), std::string::npos);
  folder.write("suite/Lost.expected", kOutcome);
  EXPECT_EQ(stems_in(folder.path()), (std::set<fs::path>{folder.stem(), folder.path() / "suite/Lost"}));
  EXPECT_NE(failure_of(folder.path() / "suite/Lost", true).find(" has no input"), std::string::npos);
}

TEST(HostileGolden, RecipesMakeTheBytesTheyDescribe) {
  EXPECT_EQ(recipe_bytes("| a b\n|\n\"\\x00\\t\\\"\"\n3 * \"xy\"\n"), std::string("a b\n\n\0\t\"xyxyxy", 14));
  EXPECT_EQ(recipe_bytes("floats 1 -2"), std::string("\0\0\x80\x3f\0\0\0\xc0", 8));
  EXPECT_EQ(recipe_bytes("\"abcdef\"\nkeep -2\nflip 0"), "\x9e"
                                                         "bcd");
  EXPECT_EQ(recipe_bytes("\"abc\"\ngzip"), recipe_bytes("# comment\n\"ab\"\n\"c\"\ngzip"));
}

TEST(HostileGolden, RecipesWithMistakesAreRefused) {
  for (const char* const recipe :
       {"| a", "file a\nnonsense", "file a\n\"abc", "file a\n\"\\x0\"", "file a\n3 \"a\"", "file a\nkeep",
        "file a\nflip 0", "file a\npng 1 1", "option nonsense 1", "option max_file_bytes", "file a\ngzip twice"})
    EXPECT_THROW(parse_recipe(recipe), std::runtime_error) << recipe;
}

} // namespace
} // namespace packtrace
