#include "runtime/commands/cli/binary_output.h"

#include <cstdio>
#include <filesystem>

#include <unistd.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"

namespace packtrace {

BinaryOutput::BinaryOutput(const std::string& target, bool force, const JsonOutput& json) {
  if (target != "-") {
    file_.emplace(target, force);
    return;
  }
  refuse_shared_stdout(true, json);
  refuse_terminal("a binary file");
}

void BinaryOutput::append(std::span<const std::byte> bytes) {
  if (file_)
    file_->append(bytes);
  else
    write_standard_output(bytes);
}

void BinaryOutput::write(std::span<const std::byte> bytes) {
  append(bytes);
  if (file_) file_->commit();
}

void refuse_shared_stdout(bool output_to_stdout, const JsonOutput& json) {
  if (output_to_stdout && json.to_stdout())
    throw Error(ErrorKind::kUsage, "-o - and --json - would both write to standard output; use a file for one of them");
}

void write_standard_output(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() || std::fflush(stdout) != 0)
    throw Error(ErrorKind::kIo, "cannot write to standard output");
}

void refuse_terminal(const std::string& what) {
  if (isatty(STDOUT_FILENO) != 0)
    throw Error(ErrorKind::kUsage,
                "-o - would write " + what + " to the terminal; redirect standard output, or use a file");
}

void fail_without_output(const std::string& verb, const std::string& input, const std::string& ending) {
  const std::string output = std::filesystem::path(input).stem().string() + ending;
  throw Error(ErrorKind::kUsage, verb + " needs -o FILE, for example: packtrace " + verb + " " + shell_word(input) +
                                     " -o " + shell_word(output));
}

} // namespace packtrace
