// write_sample_report REPORT.json OUT.html: what `packtrace measure` does last, for the test in a browser. Pictures are
// read from the folder of REPORT.json.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

#include "runtime/measure/html_report.h"

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: write_sample_report REPORT.json OUT.html\n"), 2;
  const std::filesystem::path input = argv[1];
  packtrace::write_html_report(nlohmann::json::parse(std::ifstream(input)), input.parent_path(), argv[2]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
