#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Dialects of exported shaders.
enum class ShaderForm : uint32_t {
  kShadertoy, ///< GLSL ES 3.00 with Shadertoy's conventions: mainImage(), iResolution
  kGlsl450,   ///< a fragment shader for Vulkan: out vec4 at location 0, resolution as a push constant
};

/// Published limits of the elements of all constant arrays of a shader together. An element of any type up to vec4
/// counts as one: Direct3D 11, which runs WebGL on Windows, keeps them in one buffer of vectors of four 32-bit
/// components. Source: Microsoft, d3d11.h, D3D11_REQ_IMMEDIATE_CONSTANT_BUFFER_ELEMENT_COUNT.
inline constexpr uint32_t kMaxShaderElements = 4096;
inline constexpr uint32_t kPortableShaderElements = 1024; ///< for wide support

struct ShaderConfig {
  ShaderForm form = ShaderForm::kShadertoy;
  uint32_t max_elements = kMaxShaderElements;
};

/// A float as GLSL reads it back to the same bits.
std::string glsl_float(float value);
std::string glsl_vec3(Vec3 value);
/// "ARRAY uint NAME[COUNT] = uint[COUNT](...);" and a newline. ARRAY is const in Shadertoy's form only: compilers to
/// SPIR-V copy a constant array for each access with a variable index.
std::string glsl_words(const std::string& name, std::span<const uint32_t> words);
/// "ARRAY int NAME[COUNT] = int[COUNT](...);" and a newline.
std::string glsl_ints(const std::string& name, std::span<const int32_t> values);

/// What comes before and after the functions of a form. The functions define vec3 picture(vec2 pixel, vec2 resolution),
/// pixel with its zero at the lower left, centres at halves.
std::string glsl_begin(ShaderForm form);
std::string glsl_end(ShaderForm form);

} // namespace packtrace
