#include "runtime/commands/process_usage.h"

#include <fstream>
#include <string>

#include <sys/resource.h>

namespace packtrace {

uint64_t peak_rss_bytes() {
  // getrusage() would count the program that started this one, whose memory the process had before exec().
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<uint64_t>(usage.ru_maxrss) * 1024; // Linux reports KiB
}

} // namespace packtrace
