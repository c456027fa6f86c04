#include "tests/benchmarks/packing_benchmark_machine.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

namespace packtrace {
namespace {

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string commit() {
  std::array<char, 128> text{};
  std::FILE* const pipe = ::popen("git -C '" PACKTRACE_SOURCE_DIR "' describe --always --dirty 2>/dev/null", "r");
  if (pipe == nullptr) return "unknown";
  const bool found = std::fscanf(pipe, "%127s", text.data()) == 1;
  ::pclose(pipe);
  return found ? text.data() : "unknown";
}

} // namespace

nlohmann::json describe_machine() {
  double load = 0.0;
  ::getloadavg(&load, 1);
  return {{"cpu", cpu_model()},
          {"hardware_threads", std::thread::hardware_concurrency()},
          {"load_average", load},
          {"commit", commit()}};
}

} // namespace packtrace
