#pragma once

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/compress/vertex16/vulkan_compute.h"
#include "tests/temporary_folder.h"

namespace packtrace::test {

/// Compiles GLSL with glslangValidator; fails the test with its messages if it does not compile.
/// @param stage "frag" or "comp"
/// @param spirv file to write; empty: only the check (for GLSL ES)
inline bool compile_glsl(const std::filesystem::path& folder, const std::string& text, const std::string& stage,
                         const std::filesystem::path& spirv) {
  const std::filesystem::path source = folder / ("shader." + stage), log = folder / "messages.txt";
  std::ofstream(source) << text;
  const std::string command = std::string(PACKTRACE_GLSLANG) +
                              (spirv.empty() ? " " : " -V -g0 -o " + spirv.string() + " ") + source.string() + " > " +
                              log.string() + " 2>&1";
  const bool ok = std::system(command.c_str()) == 0;
  if (!ok) {
    std::ifstream messages(log);
    ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(messages), {});
  }
  return ok;
}

/// A Shadertoy shader with what the site puts around it.
inline std::string shadertoy_program(const std::string& text) {
  return "#version 300 es\nprecision highp float;\nprecision highp int;\nuniform vec3 iResolution;\nout vec4 "
         "result;\n" +
         text + "\nvoid main() { mainImage(result, gl_FragCoord.xy); }\n";
}

/// The functions of a GLSL 450 shader as a compute shader that writes one pixel per invocation, row by row from below.
inline std::string picture_program(std::string text, uint32_t width, uint32_t height) {
  for (const char* line : {"layout(location = 0)", "layout(push_constant)"}) {
    const size_t at = text.find(line);
    text.erase(at, text.find('\n', at) - at);
  }
  text.erase(text.find("\nvoid main()"));
  const std::string w = std::to_string(width), h = std::to_string(height);
  return text +
         "\nlayout(local_size_x = 64) in;\nlayout(set = 0, binding = 0) buffer In { uint unused[]; };\n"
         "layout(set = 0, binding = 1) buffer Out { vec4 pixels[]; };\nvoid main() {\n"
         "  uint i = gl_GlobalInvocationID.x;\n  if (i >= " +
         w + "u * " + h +
         "u) return;\n"
         "  vec2 pixel = vec2(float(i % " +
         w + "u), float(i / " + w +
         "u)) + 0.5;\n"
         "  pixels[i] = vec4(picture(pixel, vec2(" +
         w + ".0, " + h + ".0)), 1.0);\n}\n";
}

/// Renders a GLSL 450 shader with Vulkan; empty without a device.
/// @return red, green, blue and 1 by pixel, row by row from below
inline std::vector<float> render_shader(const std::filesystem::path& folder, const std::string& text, uint32_t width,
                                        uint32_t height) {
  const std::filesystem::path spirv = folder / "picture.spv";
  if (!compile_glsl(folder, picture_program(text, width, height), "comp", spirv)) return {};
  const std::unique_ptr<VulkanCompute> gpu = VulkanCompute::create(spirv, 2);
  if (!gpu) return {};
  const std::vector<uint32_t> unused(4);
  const std::array<std::span<const std::byte>, 1> inputs{std::as_bytes(std::span(unused))};
  const std::vector<std::byte> bytes = gpu->run(inputs, size_t{16} * width * height, width * height);
  std::vector<float> pixels(size_t{4} * width * height);
  std::memcpy(pixels.data(), bytes.data(), bytes.size());
  return pixels;
}

} // namespace packtrace::test
