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

CommandResult run_packtrace(const std::vector<std::string>& arguments) {
  const TemporaryFolder streams;
  const std::string out = streams / "out", err = streams / "err";
  std::vector<char*> argv;
  std::string program = PACKTRACE_BINARY;
  argv.push_back(program.data());
  std::vector<std::string> copies = arguments;
  for (std::string& argument : copies) argv.push_back(argument.data());
  argv.push_back(nullptr);

  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    const int in_fd = open("/dev/null", O_RDONLY);
    const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int err_fd = open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(in_fd, 0), dup2(out_fd, 1), dup2(err_fd, 2);
    execv(program.c_str(), argv.data());
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
