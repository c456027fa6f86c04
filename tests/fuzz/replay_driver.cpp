// Runs a fuzz target without libFuzzer: all inputs of the corpus, then a fixed number of inputs made from them, which
// are the same in every run. The current input stays in a file until it has passed, so it survives a crash.

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/mutator.h"

namespace packtrace::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr char kUsage[] = "usage: TARGET [-runs=N] [-seed=N] [-timeout=SECONDS] [-dict=FILE] CORPUS...\n"
                          "  CORPUS: files, and folders of files\n";

struct Options {
  uint64_t runs = 0; ///< number of inputs to generate
  uint64_t seed = 1;
  unsigned timeout = 30; ///< seconds per input
  fs::path dictionary;
  std::vector<fs::path> corpus;
};

uint64_t number_from(const char* text) {
  uint64_t value = 0;
  const char* const end = text + std::strlen(text);
  if (text == end || std::from_chars(text, end, value).ptr != end)
    throw std::runtime_error(std::string("not a number: ") + text);
  return value;
}

Options parse_options(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    const size_t name_bytes = argument.find('=') + 1;
    const std::string name = argument.substr(0, name_bytes);
    const char* const value = arguments[i] + name_bytes;
    if (name == "-runs=")
      options.runs = number_from(value);
    else if (name == "-seed=")
      options.seed = number_from(value);
    else if (name == "-timeout=")
      options.timeout = static_cast<unsigned>(std::min<uint64_t>(number_from(value), 3600));
    else if (name == "-dict=")
      options.dictionary = value;
    else if (argument.starts_with("-"))
      throw std::runtime_error("unknown option " + argument + "\n" + kUsage);
    else
      options.corpus.emplace_back(argument);
  }
  return options;
}

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> files_of(const std::vector<fs::path>& corpus) {
  std::vector<fs::path> files;
  for (const fs::path& path : corpus) {
    if (fs::is_directory(path)) {
      for (const auto& entry : fs::recursive_directory_iterator(path))
        if (entry.is_regular_file()) files.push_back(entry.path());
    } else {
      files.push_back(path);
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Calls the target while the input is in a file of the working folder.
class Runner {
public:
  Runner(const std::string& target, unsigned timeout)
      : path_(fs::absolute(target + "-input-" + std::to_string(::getpid()))), timeout_(timeout) {
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file_ < 0) throw std::runtime_error("cannot write " + path_.string());
  }
  ~Runner() {
    ::close(file_);
    if (passed_) fs::remove(path_);
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void run(const std::string& input) {
    passed_ = false;
    const auto size = static_cast<ssize_t>(input.size());
    if (::pwrite(file_, input.data(), input.size(), 0) != size || ::ftruncate(file_, size) != 0)
      throw std::runtime_error("cannot write " + path_.string());
    // Exact size, so that sanitizers detect reads past the end.
    const auto exact = std::make_unique<uint8_t[]>(input.size());
    std::copy(input.begin(), input.end(), exact.get());
    ::alarm(timeout_);
    LLVMFuzzerTestOneInput(exact.get(), input.size());
    ::alarm(0);
    passed_ = true;
  }
  const fs::path& path() const { return path_; }

private:
  fs::path path_;
  unsigned timeout_;
  int file_ = -1;
  bool passed_ = true;
};

void run_all(const Options& options, Runner& runner) {
  std::vector<std::string> corpus;
  for (const fs::path& file : files_of(options.corpus)) {
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    corpus.push_back(read_file(file));
    runner.run(corpus.back());
  }
  if (corpus.empty()) throw std::runtime_error("the corpus is empty");
  size_t longest = 0;
  for (const std::string& input : corpus) longest = std::max(longest, input.size());
  std::vector<std::string> words;
  if (!options.dictionary.empty()) words = parse_dictionary(read_file(options.dictionary));
  const size_t inputs = corpus.size();
  Mutator mutator(std::move(corpus), std::move(words), options.seed, 2 * longest);
  for (uint64_t i = 0; i < options.runs; ++i) runner.run(mutator.next());
  std::printf("%zu inputs and %llu made from them passed\n", inputs, static_cast<unsigned long long>(options.runs));
}

} // namespace
} // namespace packtrace::fuzz

int main(int count, char** arguments) {
  using namespace packtrace::fuzz;
  try {
    const Options options = parse_options(count, arguments);
    Runner runner(fs::path(arguments[0]).filename().string(), options.timeout);
    std::printf("the input under test is in %s\n", runner.path().c_str());
    std::fflush(stdout);
    run_all(options, runner);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
