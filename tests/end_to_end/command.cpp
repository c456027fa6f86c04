#include "tests/end_to_end/command.h"

#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

namespace packtrace::test {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

CommandResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const std::vector<std::string>& environment, const std::filesystem::path& folder,
                          const std::function<void()>& prepare) {
  const TemporaryFolder streams;
  const std::string out = streams / "out", err = streams / "err";
  std::vector<std::string> words{program}, variables = environment;
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    const int in_fd = open("/dev/null", O_RDONLY);
    const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int err_fd = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(in_fd, 0), dup2(out_fd, 1), dup2(err_fd, 2);
    for (std::string& variable : variables) putenv(variable.data());
    if (!folder.empty() && chdir(folder.c_str()) != 0) _exit(126);
    if (prepare) prepare();
    execvp(program.c_str(), argv.data());
    _exit(127);
  }
  int status = 0;
  waitpid(child, &status, 0);
  CommandResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = read_text(out);
  result.err = read_text(err);
  return result;
}

std::string packtrace_program() { return PACKTRACE_BINARY; }

CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::vector<std::string>& environment,
                            const std::filesystem::path& folder) {
  return run_program(packtrace_program(), arguments, environment, folder);
}

CommandResult run_packtrace(const std::vector<std::string>& arguments, const std::function<void()>& prepare) {
  return run_program(packtrace_program(), arguments, {}, {}, prepare);
}

std::string small_scene_text() {
  return R"(LookAt 0 1 -4  0 0.5 0  0 1 0
Camera "perspective" "float fov" [50]
Film "image" "integer xresolution" [64] "integer yresolution" [48] "string filename" ["small.exr"]
WorldBegin
Material "matte" "rgb Kd" [0.5 0.6 0.7]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-2 0 -2  -2 0 2  2 0 2  2 0 -2]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-2 0 2  -2 2 2  2 2 2  2 0 2]
WorldEnd
)";
}

} // namespace packtrace::test
