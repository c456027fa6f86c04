#include "runtime/commands/cli/progress_display.h"

#include <algorithm>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/progress.h"

namespace packtrace {
namespace {

/// A display that writes to a file and uses a clock set by the test.
class Screen {
public:
  explicit Screen(bool terminal, bool quiet = false)
      : file_(std::tmpfile()), display_({file_, terminal, quiet, [this] { return now_; }}) {}
  ~Screen() {
    display_.finish();
    std::fclose(file_);
  }
  void wait(double seconds) { now_ += seconds; }
  ProgressDisplay& display() { return display_; }
  std::string text() {
    std::rewind(file_);
    std::string all;
    for (int c = std::fgetc(file_); c != EOF; c = std::fgetc(file_)) all.push_back(static_cast<char>(c));
    return all;
  }

private:
  double now_ = 1000.0;
  std::FILE* file_;
  ProgressDisplay display_;
};

TEST(ProgressText, ShowsWhatIsKnown) {
  EXPECT_EQ(progress_text("tracing", 1, 4, 3.0), "tracing: 25% after 3.0 s, 9.0 s left");
  EXPECT_EQ(progress_text("tracing", 0, 4, 3.0), "tracing: 0% after 3.0 s");
  EXPECT_EQ(progress_text("tracing", 7, 0, 3.0), "tracing: 3.0 s");
  EXPECT_EQ(progress_text("tracing", 4, 4, 3.0), "tracing: 100% after 3.0 s");
  EXPECT_EQ(progress_text("tracing", 999999, 1000000, 1.0), "tracing: 99% after 1.0 s, 0.0 s left");
  EXPECT_EQ(progress_text("tracing", 1, 101, 90.0), "tracing: 0% after 1 min 30 s, 2 h 30 min left");
  EXPECT_EQ(progress_text("tracing", 9, 4, 3.0), "tracing: 100% after 3.0 s") << "never beyond the end";
}

TEST(ProgressDisplay, PlainOutputIsSparse) {
  Screen screen(false);
  Progress progress(screen.display().observer());
  progress.begin("reading", 100);
  for (int i = 0; i < 100; ++i) screen.wait(0.25), progress.advance();
  progress.begin("packing", 10);
  screen.wait(1.0);
  progress.advance(10);
  screen.display().finish();
  EXPECT_EQ(screen.text(), "reading: 40% after 10.0 s, 15.0 s left\nreading: 80% after 20.0 s, 5.0 s left\n"
                           "reading: 25.0 s\npacking: 1.0 s\n");
}

TEST(ProgressDisplay, PlainOutputLeavesOutMomentsAndTrustsThatWorkWentOn) {
  Screen screen(false);
  Progress progress(screen.display().observer());
  progress.begin("reading", 100); // counts nothing, but is finished because the next phase begins
  screen.wait(2.0);
  progress.begin("measuring", 10);
  screen.wait(0.1);
  progress.advance(10);
  progress.begin("packing", 10);
  screen.wait(0.1);
  progress.advance(5);
  screen.display().finish();
  EXPECT_EQ(screen.text(), "reading: 2.0 s\npacking: stopped after 0.1 s\n");
}

TEST(ProgressDisplay, ATerminalHasOneLinePerPhase) {
  Screen screen(true);
  Progress progress(screen.display().observer());
  progress.begin("reading", 10);
  for (int i = 0; i < 10; ++i) screen.wait(0.2), progress.advance();
  progress.begin("packing", 10);
  screen.display().finish();
  const std::string text = screen.text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\r'), 12);
  EXPECT_NE(text.find("\r\x1b[Kreading: 50% after 1.0 s, 1.0 s left"), std::string::npos);
  EXPECT_NE(text.find("\r\x1b[Kpacking: stopped after 0.0 s\n"), std::string::npos) << text;
}

TEST(ProgressDisplay, UpdatesAreThrottled) {
  Screen screen(true);
  Progress progress(screen.display().observer());
  progress.begin("reading", 100000);
  for (int i = 0; i < 99999; ++i) screen.wait(1e-5), progress.advance();
  const std::string text = screen.text();
  EXPECT_LE(std::count(text.begin(), text.end(), '\r'), 10);
  EXPECT_GE(std::count(text.begin(), text.end(), '\r'), 9);
}

TEST(ProgressDisplay, QuietShowsNothing) {
  Screen screen(true, true);
  Progress progress(screen.display().observer());
  progress.begin("reading", 2);
  screen.wait(100.0);
  progress.advance(2);
  screen.display().finish();
  EXPECT_EQ(screen.text(), "");
}

TEST(ProgressDisplay, ManyThreadsMayReport) {
  std::FILE* file = std::tmpfile();
  {
    ProgressDisplay display({file, true, false, {}});
    Progress progress(display.observer());
    progress.begin("reading", 40000);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (int i = 0; i < 10000; ++i) progress.advance();
      });
    for (std::thread& thread : threads) thread.join();
  }
  EXPECT_GT(std::ftell(file), 0);
  std::fclose(file);
}

} // namespace
} // namespace packtrace
