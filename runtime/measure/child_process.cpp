#include "runtime/measure/child_process.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/progress.h"
#include "runtime/stopwatch.h"

namespace packtrace {
namespace {

constexpr size_t kKeptError = 4000; ///< bytes of standard error

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorKind::kIo, std::string(what) + ": " + std::generic_category().message(errno));
}

/// Runs in the child: only async-signal-safe calls.
[[noreturn]] void become(const char* program, char* const* argv, int error_pipe, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(127);
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  dup2(null, STDIN_FILENO);
  dup2(null, STDOUT_FILENO);
  dup2(error_pipe, STDERR_FILENO);
  execv(program, argv);
  _exit(127);
}

/// Keeps the last bytes of a pipe's text. Returns false at its end.
bool read_some(int descriptor, std::string& text) {
  char block[4096];
  const ssize_t n = read(descriptor, block, sizeof block);
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  text.append(block, static_cast<size_t>(n));
  if (text.size() > 2 * kKeptError) text.erase(0, text.size() - kKeptError);
  return n > 0;
}

/// Reads the child's errors until it closes them, and interrupts it if this process is cancelled.
void follow(pid_t child, int errors, std::string& text) {
  bool interrupted = false;
  for (bool open = true; open;) {
    pollfd waiting{errors, POLLIN, 0};
    const int ready = poll(&waiting, 1, 100);
    if (ready > 0) open = read_some(errors, text);
    if (Progress::cancelled() && !interrupted) {
      kill(child, SIGTERM);
      interrupted = true;
    }
  }
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

std::string ascii(std::string text) {
  if (text.size() > kKeptError) text.erase(0, text.size() - kKeptError);
  for (char& c : text)
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

} // namespace

ChildResult run_child(const Words& arguments, const std::string& program) {
  const std::string path = program.empty() ? "/proc/self/exe" : program;
  std::vector<char*> argv{const_cast<char*>(program.empty() ? "packtrace" : program.c_str())};
  for (const std::string& word : arguments) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) fail("cannot start a process");
  const Stopwatch clock;
  const pid_t parent = getpid(), child = fork();
  if (child == 0) become(path.c_str(), argv.data(), ends[1], parent);
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    fail("cannot start a process");
  }
  ChildResult result;
  follow(child, ends[0], result.error);
  close(ends[0]);
  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0)
    if (errno != EINTR) fail("cannot wait for a process");
  result.seconds = clock.seconds();
  if (Progress::cancelled()) throw Error(ErrorKind::kCancelled, "cancelled");
  if (WIFSIGNALED(status))
    result.signal = WTERMSIG(status);
  else
    result.exit_code = WEXITSTATUS(status);
  result.error = ascii(std::move(result.error));
  result.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  result.peak_bytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024; // Linux reports KiB
  return result;
}

} // namespace packtrace
