#include "tests/benchmarks/benchmark_options.h"

#include <CLI/CLI.hpp>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

CLI::Option& cli(void* option) { return *static_cast<CLI::Option*>(option); }

} // namespace

BenchmarkOption& BenchmarkOption::required() { return cli(option_).required(), *this; }
BenchmarkOption& BenchmarkOption::show_default() { return cli(option_).capture_default_str(), *this; }
BenchmarkOption& BenchmarkOption::type_name(const std::string& name) { return cli(option_).type_name(name), *this; }
BenchmarkOption& BenchmarkOption::environment(const std::string& variable) {
  return cli(option_).envname(variable), *this;
}
BenchmarkOption& BenchmarkOption::delimiter(char delimiter) { return cli(option_).delimiter(delimiter), *this; }
BenchmarkOption& BenchmarkOption::one_argument() { return cli(option_).allow_extra_args(false), *this; }
BenchmarkOption& BenchmarkOption::range(int lo, int hi) { return cli(option_).check(CLI::Range(lo, hi)), *this; }
BenchmarkOption& BenchmarkOption::range(uint32_t lo, uint32_t hi) {
  return cli(option_).check(CLI::Range(lo, hi)), *this;
}
BenchmarkOption& BenchmarkOption::range(double lo, double hi) { return cli(option_).check(CLI::Range(lo, hi)), *this; }
BenchmarkOption& BenchmarkOption::positive() { return cli(option_).check(CLI::PositiveNumber), *this; }
BenchmarkOption& BenchmarkOption::not_negative() { return cli(option_).check(CLI::NonNegativeNumber), *this; }
BenchmarkOption& BenchmarkOption::one_of(const std::vector<std::string>& values) {
  return cli(option_).check(CLI::IsMember(values)), *this;
}
BenchmarkOption& BenchmarkOption::one_of_or_file(const std::vector<std::string>& values) {
  return cli(option_).check(CLI::IsMember(values) | CLI::ExistingFile), *this;
}
BenchmarkOption& BenchmarkOption::existing_folder() { return cli(option_).check(CLI::ExistingDirectory), *this; }

struct BenchmarkOptions::App : CLI::App {
  using CLI::App::App;

  template <class Value>
  BenchmarkOption add(const std::string& name, Value& value, const std::string& help) {
    return BenchmarkOption(add_option(name, value, help));
  }
};

BenchmarkOptions::BenchmarkOptions(const std::string& description) : app_(std::make_unique<App>(description)) {}
BenchmarkOptions::~BenchmarkOptions() = default;

BenchmarkOption BenchmarkOptions::add(const std::string& name, int& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, uint32_t& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, uint64_t& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, double& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::optional<double>& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::string& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::filesystem::path& value, const std::string& help) {
  return app_->add(name, value, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::vector<uint32_t>& values, const std::string& help) {
  return app_->add(name, values, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::vector<double>& values, const std::string& help) {
  return app_->add(name, values, help);
}
BenchmarkOption BenchmarkOptions::add(const std::string& name, std::vector<std::string>& values,
                                      const std::string& help) {
  return app_->add(name, values, help);
}

void BenchmarkOptions::flag(const std::string& name, bool& value, const std::string& help) {
  app_->add_flag(name, value, help);
}

std::optional<int> BenchmarkOptions::parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? 0 : static_cast<int>(ErrorKind::kUsage);
  }
  return std::nullopt;
}

} // namespace packtrace
