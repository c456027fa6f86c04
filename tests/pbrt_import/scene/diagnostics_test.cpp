#include "pbrt_import/base/diagnostics.h"

#include <algorithm>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

SourceLocation at(const std::shared_ptr<const SourceFile>& file, uint32_t line, uint32_t column) {
  return {file, line, column};
}

TEST(Diagnostics, TextHasPlaceSeverityAndIncludeChain) {
  const auto main_file = std::make_shared<const SourceFile>(SourceFile{"main.pbrt", {}});
  const auto included = std::make_shared<const SourceFile>(SourceFile{"geometry.pbrt", at(main_file, 7, 1)});
  Diagnostics diagnostics;
  diagnostics.report(Severity::kError, at(included, 3, 9), "bad radius");
  ASSERT_EQ(diagnostics.entries().size(), 1u);
  EXPECT_EQ(to_string(diagnostics.entries()[0]), "geometry.pbrt:3:9: error: bad radius\n  included from main.pbrt:7:1");
}

/// Text of an error in the last of `files` files, each included by the previous one.
std::string text_of_chain(int files) {
  SourceLocation place;
  for (int i = 0; i < files; ++i)
    place = {std::make_shared<const SourceFile>(SourceFile{"f" + std::to_string(i), place}), 1, 1};
  return to_string(Diagnostic{Severity::kError, place, "bad", 1});
}

TEST(Diagnostics, LongIncludeChainsAreShortenedInTheMiddle) {
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n') + 1; };
  EXPECT_EQ(lines(text_of_chain(10)), 10);
  EXPECT_EQ(text_of_chain(64), "f63:1:1: error: bad\n  included from f62:1:1\n  included from f61:1:1\n"
                               "  included from f60:1:1\n  included from f59:1:1\n  ... and through 55 more files\n"
                               "  included from f3:1:1\n  included from f2:1:1\n  included from f1:1:1\n"
                               "  included from f0:1:1");
}

TEST(Diagnostics, RepeatsAreCountedAndTheFirstPlaceIsKept) {
  const auto file = std::make_shared<const SourceFile>(SourceFile{"a.pbrt", {}});
  Diagnostics diagnostics;
  for (const uint32_t line : {9u, 4u, 6u}) diagnostics.report(Severity::kWarning, at(file, line, 2), "odd", line);
  ASSERT_EQ(diagnostics.entries().size(), 1u);
  EXPECT_EQ(to_string(diagnostics.entries()[0]), "a.pbrt:4:2: warning: odd (3 times, first here)");
  EXPECT_EQ(diagnostics.count(Severity::kWarning), 3u);
  EXPECT_EQ(diagnostics.count(Severity::kError), 0u);
}

TEST(Diagnostics, TheSameMessageInAnotherFileIsAnotherProblem) {
  Diagnostics diagnostics;
  for (const char* path : {"a.pbrt", "b.pbrt"})
    diagnostics.report(Severity::kError, {std::make_shared<const SourceFile>(SourceFile{path, {}}), 1, 1}, "odd");
  EXPECT_EQ(diagnostics.entries().size(), 2u);
}

TEST(Diagnostics, OrderFollowsTheSequenceWhateverThreadReportsFirst) {
  const auto file = std::make_shared<const SourceFile>(SourceFile{"a.pbrt", {}});
  Diagnostics diagnostics;
  std::vector<std::thread> threads;
  for (uint64_t i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (uint64_t k = 0; k < 50; ++k) {
        const uint64_t sequence = (49 - k) * 4 + i;
        diagnostics.report(Severity::kError, at(file, 0, 0), "problem " + std::to_string(sequence), sequence);
      }
    });
  for (std::thread& thread : threads) thread.join();
  const std::vector<Diagnostic> entries = diagnostics.entries();
  ASSERT_EQ(entries.size(), 200u);
  for (size_t i = 0; i < entries.size(); ++i) EXPECT_EQ(entries[i].message, "problem " + std::to_string(i));
}

TEST(Diagnostics, AProblemWithoutAFileHasNoPlace) {
  Diagnostics diagnostics;
  diagnostics.report(Severity::kNote, {}, "nothing to see");
  EXPECT_EQ(to_string(diagnostics.entries()[0]), "note: nothing to see");
}

} // namespace
} // namespace packtrace
