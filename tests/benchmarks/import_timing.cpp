#include "tests/benchmarks/import_timing.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <ctime>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/import_scene.h"

namespace packtrace {
namespace {

double milliseconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_usec) * 1e-3;
}

double thread_cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

template <class Work>
double wall_ms(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Calls work() in a child process and returns its result. If work() throws, prints the error to stderr and throws
/// Error(kInput) here.
/// is thrown here.
template <class Work>
auto in_child(const Work& work, rusage& usage) {
  using Result = std::invoke_result_t<Work>;
  static_assert(std::is_trivially_copyable_v<Result>);
  int ends[2];
  if (::pipe(ends) != 0) throw Error(ErrorKind::kIo, fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t child = ::fork();
  if (child < 0) throw Error(ErrorKind::kIo, fmt::format("cannot make a process: {}", std::strerror(errno)));
  if (child == 0) {
    int exit_code = 0;
    try {
      const Result result = work();
      if (::write(ends[1], &result, sizeof result) != sizeof result) exit_code = 1;
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      exit_code = 1;
    }
    ::_exit(exit_code);
  }
  ::close(ends[1]);
  Result result{};
  const bool complete = ::read(ends[0], &result, sizeof result) == sizeof result;
  ::close(ends[0]);
  int status = 0;
  ::wait4(child, &status, 0, &usage);
  if (!complete || status != 0)
    throw Error(ErrorKind::kInput, fmt::format("the measuring process ended with status {:#x}", status));
  return result;
}

void require_found(const char* what, size_t found, const std::optional<uint64_t>& expected) {
  if (expected && found != *expected)
    throw Error(ErrorKind::kInput, fmt::format("{} {} were imported instead of {}", found, what, *expected));
}

/// Wall time of import_scene() in milliseconds.
double import_ms(const ImportInput& input, uint32_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  Diagnostics diagnostics;
  Progress progress;
  ImportResult result;
  const double elapsed_ms = wall_ms([&] { result = import_scene(input.main_file, {}, diagnostics, progress); });
  require_found("triangles", result.statistics.triangles, input.triangles);
  require_found("instances", result.scene.instances.size(), input.instances);
  if (!input.triangles) return elapsed_ms; // an existing scene, which may have faults
  for (const Diagnostic& diagnostic : diagnostics.entries())
    if (diagnostic.severity != Severity::kNote) throw Error(ErrorKind::kInput, to_string(diagnostic));
  return elapsed_ms;
}

bool is_separator(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '[' || c == ']'; }

/// Parses all numbers and returns their sum, so that the compiler cannot remove the work.
double scan_numbers(std::string_view text) {
  double sum = 0;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end) {
    if ((*at >= '0' && *at <= '9') || *at == '-' || *at == '.') {
      float value = 0;
      const std::from_chars_result result = std::from_chars(at, end, value);
      sum += static_cast<double>(value);
      at = std::max(result.ptr, at + 1);
    } else if (is_separator(*at)) {
      ++at;
    } else {
      while (at != end && !is_separator(*at)) ++at;
    }
  }
  return sum;
}

/// Receives results, so that the compiler cannot remove the work.
volatile double sink;

Calibration calibrate_text(const ImportInput& input) {
  std::string text, copy(input.bytes, 'x'); // filled, so that its pages are mapped
  text.reserve(input.bytes);
  for (const auto& file : input.files) {
    const std::vector<std::byte> bytes = read_file_bytes(file);
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  Calibration result;
  double start = thread_cpu_ms();
  std::memcpy(copy.data(), text.data(), std::min(text.size(), copy.size()));
  result.copy_ms = thread_cpu_ms() - start;
  sink = copy[copy.size() / 2];
  const std::string_view all = text, half = all.substr(0, all.size() / 2);
  result.scan_wall_ms = wall_ms([&] {
    start = thread_cpu_ms();
    sink = scan_numbers(all);
    result.scan_ms = thread_cpu_ms() - start;
  });
  result.two_thread_scan_wall_ms = wall_ms([&] {
    double sums[2];
    std::thread other([&] { sums[1] = scan_numbers(all.substr(half.size())); });
    sums[0] = scan_numbers(half);
    other.join();
    sink = sums[0] + sums[1];
  });
  return result;
}

Calibration calibrate_binary(const ImportInput& input) {
  std::string buffer(256 * 1024, 'x'), copy(input.bytes + buffer.size(), 'x');
  size_t copied = 0;
  const double start = thread_cpu_ms();
  for (const auto& file : input.files) {
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) throw Error(ErrorKind::kIo, fmt::format("{}: cannot open", file.string()));
    ssize_t count = 0;
    while (copied < input.bytes && (count = ::read(descriptor, buffer.data(), buffer.size())) > 0) {
      std::memcpy(copy.data() + copied, buffer.data(), static_cast<size_t>(count));
      copied += static_cast<size_t>(count);
    }
    ::close(descriptor);
  }
  sink = copy[copied / 2];
  Calibration result;
  result.copy_ms = thread_cpu_ms() - start;
  return result;
}

} // namespace

ImportTiming time_import(const ImportInput& input, uint32_t threads) {
  rusage usage{};
  const double elapsed_ms = in_child([&] { return import_ms(input, threads); }, usage);
  return {milliseconds(usage.ru_utime) + milliseconds(usage.ru_stime), elapsed_ms,
          static_cast<double>(usage.ru_maxrss) / 1024};
}

Calibration calibrate(const ImportInput& input) {
  rusage usage{};
  return in_child([&] { return input.binary ? calibrate_binary(input) : calibrate_text(input); }, usage);
}

} // namespace packtrace
