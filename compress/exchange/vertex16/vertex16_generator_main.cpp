#include <cstdio>
#include <fstream>
#include <string>

#include "compress/exchange/vertex16/vertex16_generator.h"

/// Writes vertex16.glsl and vertex16_decode.h into a folder.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: vertex16_generator FOLDER\n", stderr);
    return 2;
  }
  const std::string folder = std::string(argv[1]) + "/";
  std::ofstream glsl(folder + "vertex16.glsl", std::ios::binary), cpp(folder + "vertex16_decode.h", std::ios::binary);
  glsl << packtrace::vertex16_glsl();
  cpp << packtrace::vertex16_cpp();
  glsl.close(), cpp.close();
  return glsl && cpp ? 0 : 6;
}
