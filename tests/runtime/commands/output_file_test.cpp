#include "pbrt_import/base/output_file.h"

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/replaced_file.h"
#include "runtime/commands/cli/json_output.h"
#include "tests/runtime/image/image_test_support.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

void write_text(const std::filesystem::path& path, std::string_view text) {
  write_file_bytes(path, std::as_bytes(std::span(text)));
}

std::string read_text(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  const TemporaryFolder folder;
  OutputFile file(folder / "a.txt", false);
  write_text(file.path(), "new");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  file.commit();
  EXPECT_EQ(read_text(folder / "a.txt"), "new");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(OutputFile, LeavesNothingWhenAbandoned) {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "old");
  {
    const OutputFile file(folder / "a.txt", true);
    write_text(file.path(), "half");
  }
  EXPECT_EQ(read_text(folder / "a.txt"), "old");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(OutputFile, ReplacesOnlyWithForce) {
  const TemporaryFolder folder;
  write_text(folder / "a.txt", "old");
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder / "a.txt", false); }), ErrorKind::kIo);
  OutputFile file(folder / "a.txt", true);
  write_text(file.path(), "new");
  file.commit();
  EXPECT_EQ(read_text(folder / "a.txt"), "new");
}

TEST(OutputFile, CannotReplaceWhatIsRead) {
  const TemporaryFolder folder;
  for (const char* const name : {"a.ply", "b.ply"}) write_text(folder / name, "mesh");
  std::filesystem::create_hard_link(folder / "a.ply", folder / "hard.png");
  std::filesystem::create_symlink(folder / "a.ply", folder / "soft.png");
  const std::vector<std::filesystem::path> inputs{folder / "missing.ply", folder / "a.ply"};
  for (const char* const name : {"a.ply", "./a.ply", "hard.png", "soft.png"}) {
    EXPECT_EQ(error_kind_of([&] { refuse_to_replace(inputs, folder / name); }), ErrorKind::kUsage) << name;
    const OutputFile file(folder / name, true);
    EXPECT_EQ(error_kind_of([&] { refuse_to_replace(inputs); }), ErrorKind::kUsage) << name;
  }
  for (const char* const name : {"b.ply", "new.ply", "missing.ply"}) {
    const OutputFile file(folder / name, true);
    EXPECT_NO_THROW(refuse_to_replace(inputs)) << name;
  }
}

TEST(OutputFile, TwoCannotHaveOneTarget) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "sub");
  write_text(folder / "a.txt", "old");
  std::filesystem::create_symlink(folder / "a.txt", folder / "link.txt");
  {
    const OutputFile first(folder / "a.txt", true);
    for (const char* name : {"a.txt", "./a.txt", "sub/../a.txt", "link.txt"})
      EXPECT_EQ(error_kind_of([&] { OutputFile(folder / name, true); }), ErrorKind::kUsage) << name;
    const OutputFile other(folder / "sub/a.txt", true);
  }
  OutputFile(folder / "a.txt", true).commit();
  OutputFile(folder / "a.txt", true).commit();
}

TEST(OutputFile, DoesNotReplaceWhatAppearedMeanwhile) {
  const TemporaryFolder folder;
  {
    OutputFile file(folder / "a.txt", false);
    write_text(folder / "a.txt", "somebody else's");
    EXPECT_EQ(error_kind_of([&] { file.commit(); }), ErrorKind::kIo);
  }
  EXPECT_EQ(read_text(folder / "a.txt"), "somebody else's");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(OutputFile, RefusesWhatIsNotAFile) {
  const TemporaryFolder folder;
  write_text(folder / "file", "");
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder.path(), true); }), ErrorKind::kIo);
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder / "", true); }), ErrorKind::kIo);
  EXPECT_EQ(error_kind_of([&] { OutputFile("/dev/null", true); }), ErrorKind::kIo);
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder / "missing" / "a", true); }), ErrorKind::kIo);
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder / "file" / "a", true); }), ErrorKind::kIo);
  EXPECT_EQ(error_kind_of([&] { OutputFile("", true); }), ErrorKind::kUsage);
}

TEST(OutputFile, WritesThroughSymbolicLinks) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "elsewhere");
  write_text(folder / "elsewhere" / "a.txt", "old");
  std::filesystem::create_symlink(folder / "elsewhere" / "a.txt", folder / "link");
  EXPECT_EQ(error_kind_of([&] { OutputFile(folder / "link", false); }), ErrorKind::kIo);
  OutputFile file(folder / "link", true);
  write_text(file.path(), "new");
  file.commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read_text(folder / "elsewhere" / "a.txt"), "new");
}

TEST(OutputFile, UnfinishedFilesCanBeRemovedAtOnce) {
  const TemporaryFolder folder;
  OutputFile kept(folder / "kept", false);
  kept.commit();
  const OutputFile a(folder / "a", false), b(folder / "b", false);
  remove_unfinished_output();
  EXPECT_EQ(folder.files(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder / "kept"));
}

TEST(OutputFile, KilledProcessesLeaveNothing) {
  const TemporaryFolder folder;
  for (const bool force : {false, true}) {
    const pid_t child = fork();
    if (child == 0) {
      OutputFile file(folder / "a", force);
      file.write(std::as_bytes(std::span("half", 4)));
      std::raise(SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    // The file vanishes with the process, or else when the next output is written to the folder.
    remove_stale_output(folder.path());
    EXPECT_EQ(folder.files(), 0u);
  }
}

TEST(OutputFile, OnlyFilesOfDeadProcessesAreStale) {
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) std::_Exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child); // the child's process id is free now
  const auto name = [&](pid_t owner, int number) {
    return folder / (".packtrace-" + std::to_string(owner) + "-" + std::to_string(number) + ".tmp");
  };
  write_text(name(child, 1), "stale");
  write_text(name(child, 2), "of a process in another container");
  write_text(name(getpid(), 1), "in use");
  write_text(folder / ".packtrace-x-1.tmp", "of somebody else");
  write_text(folder / "notes.tmp", "of somebody else");
  const Descriptor locked(open(name(child, 2).c_str(), O_RDONLY));
  ASSERT_EQ(flock(locked.get(), LOCK_EX), 0);
  remove_stale_output(folder.path());
  EXPECT_FALSE(std::filesystem::exists(name(child, 1)));
  EXPECT_EQ(folder.files(), 4u);
}

TEST(OutputFile, PermissionsAreThoseOfNewFiles) {
  const TemporaryFolder folder;
  const mode_t before = umask(0027);
  for (const bool force : {false, true}) {
    OutputFile file(folder / "a", force);
    file.commit();
    struct stat info{};
    ASSERT_EQ(stat((folder / "a").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777u, 0640u) << force;
  }
  umask(before);
  EXPECT_EQ(folder.files(), 1u);
}

TEST(OutputFile, FullDisksAreReportedByTheNameOfTheTarget) {
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit limit{10, 10};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      OutputFile file(folder / "a", false);
      file.write(std::vector<std::byte>(100));
    } catch (const Error& error) {
      const bool named = std::string(error.what()).starts_with((folder / "a").string() + ": cannot write");
      std::_Exit(named ? error.exit_code() : 1);
    }
    std::_Exit(2);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 6);
}

void make_no_link(const std::filesystem::path&, const std::filesystem::path&, std::error_code& error) {
  error = std::make_error_code(std::errc::operation_not_supported);
}

TEST(ReplacedFile, TheContentComesBackWithAndWithoutHardLinks) {
  const TemporaryFolder folder;
  ReplacedFile::Link* const make_link = std::filesystem::create_hard_link;
  for (ReplacedFile::Link* const link : {make_link, &make_no_link}) {
    write_text(folder / "a", "old");
    {
      ReplacedFile kept(folder / "a", *link);
      OutputFile output(folder / "a", true);
      output.write(std::as_bytes(std::span(std::string_view("new"))));
      output.commit();
      EXPECT_EQ(read_text(folder / "a"), "new");
      kept.restore();
      EXPECT_EQ(read_text(folder / "a"), "old");
    }
    EXPECT_EQ(read_text(folder / "a"), "old");
    EXPECT_EQ(folder.files(), 1u);
  }
  const ReplacedFile nothing(folder / "b");
  EXPECT_EQ(folder.files(), 1u);
}

TEST(JsonOutput, WritesFilesThatParse) {
  const TemporaryFolder folder;
  JsonOutput json(folder / "a.json", false);
  EXPECT_TRUE(json.wanted());
  EXPECT_FALSE(json.to_stdout());
  json.write({{"psnr", std::numeric_limits<double>::infinity()}, {"nan", std::nan("")}, {"name", "bad \xff byte"}});
  const nlohmann::json read = nlohmann::json::parse(read_text(folder / "a.json"));
  EXPECT_TRUE(read["psnr"].is_null());
  EXPECT_TRUE(read["nan"].is_null());
  EXPECT_EQ(read["name"], "bad \xef\xbf\xbd byte");
}

TEST(JsonOutput, DashIsStandardOutput) {
  JsonOutput json("-", false);
  EXPECT_TRUE(json.to_stdout());
  testing::internal::CaptureStdout();
  json.write({{"a", 1}});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "{\n  \"a\": 1\n}\n");
}

TEST(JsonOutput, NowhereIsNowhere) {
  JsonOutput json("", false);
  EXPECT_FALSE(json.wanted());
  testing::internal::CaptureStdout();
  json.write({{"a", 1}});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

} // namespace
} // namespace packtrace
