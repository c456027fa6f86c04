#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace packtrace {

/// An option of a benchmark. Its functions return it, so that calls can be chained.
class BenchmarkOption {
public:
  explicit BenchmarkOption(void* option) : option_(option) {}
  BenchmarkOption& required();
  /// Shows the value that the variable has now as the default.
  BenchmarkOption& show_default();
  /// Shows this instead of the type of the value.
  BenchmarkOption& type_name(const std::string& name);
  /// Takes the value from an environment variable if the command line has none.
  BenchmarkOption& environment(const std::string& variable);
  /// Splits an argument into values at this character.
  BenchmarkOption& delimiter(char delimiter);
  /// Takes all values from one argument.
  BenchmarkOption& one_argument();
  /// Refuses values outside the closed range.
  BenchmarkOption& range(int lo, int hi);
  BenchmarkOption& range(uint32_t lo, uint32_t hi);
  BenchmarkOption& range(double lo, double hi);
  BenchmarkOption& positive();
  BenchmarkOption& not_negative();
  BenchmarkOption& one_of(const std::vector<std::string>& values);
  BenchmarkOption& one_of_or_file(const std::vector<std::string>& values);
  BenchmarkOption& existing_folder();

private:
  void* option_; ///< CLI::Option
};

/// The command line of a benchmark. It hides CLI11: a source that includes CLI11 takes about three seconds longer to
/// compile.
class BenchmarkOptions {
public:
  explicit BenchmarkOptions(const std::string& description);
  ~BenchmarkOptions();
  BenchmarkOptions(const BenchmarkOptions&) = delete;
  BenchmarkOptions& operator=(const BenchmarkOptions&) = delete;

  /// Adds an option ("--name") or positional argument ("NAME"). Parsing writes to `value`.
  BenchmarkOption add(const std::string& name, int& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, uint32_t& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, uint64_t& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, double& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::optional<double>& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::string& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::filesystem::path& value, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::vector<uint32_t>& values, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::vector<double>& values, const std::string& help = "");
  BenchmarkOption add(const std::string& name, std::vector<std::string>& values, const std::string& help = "");
  /// Adds a flag, which sets `value`; with "!" before its name it clears it.
  void flag(const std::string& name, bool& value, const std::string& help);

  /// Returns the exit code if the program ends here: it only prints help, or an option is wrong.
  std::optional<int> parse(int argc, const char* const* argv);

private:
  struct App;
  std::unique_ptr<App> app_;
};

} // namespace packtrace
