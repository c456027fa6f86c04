#include "compress/exchange/shader/shader_text.h"

#include <cstdio>

namespace packtrace {
namespace {

template <class Value, class Print>
std::string array_text(const char* type, const std::string& name, std::span<const Value> values, const Print& print) {
  const std::string count = std::to_string(values.size());
  std::string text = std::string("ARRAY ") + type + " " + name + "[" + count + "] = " + type + "[" + count + "](";
  for (size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ",";
    if (i % 8 == 0) text += "\n  ";
    text += print(values[i]);
  }
  return text + ");\n";
}

} // namespace

std::string glsl_float(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  std::string result(text);
  if (result.find_first_of(".e") == std::string::npos) result += ".0";
  return result;
}

std::string glsl_vec3(Vec3 value) {
  return "vec3(" + glsl_float(value.x) + ", " + glsl_float(value.y) + ", " + glsl_float(value.z) + ")";
}

std::string glsl_words(const std::string& name, std::span<const uint32_t> words) {
  return array_text("uint", name, words, [](uint32_t word) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%xu", word);
    return std::string(text);
  });
}

std::string glsl_ints(const std::string& name, std::span<const int32_t> values) {
  return array_text("int", name, values, [](int32_t value) { return std::to_string(value); });
}

std::string glsl_begin(ShaderForm form) {
  if (form == ShaderForm::kShadertoy) return "#define EXACT\n#define ARRAY const\n\n";
  return "#version 450\n"
         "layout(location = 0) out vec4 out_color;\n"
         "layout(push_constant) uniform Push { vec2 resolution; } push; // pixels\n"
         "#define EXACT precise\n#define ARRAY\n\n";
}

std::string glsl_end(ShaderForm form) {
  if (form == ShaderForm::kShadertoy)
    return "\nvoid mainImage(out vec4 color, in vec2 pixel) { color = vec4(picture(pixel, iResolution.xy), 1.0); }\n";
  return "\nvoid main() {\n"
         "  vec2 pixel = vec2(gl_FragCoord.x, push.resolution.y - gl_FragCoord.y);\n"
         "  out_color = vec4(picture(pixel, push.resolution), 1.0);\n"
         "}\n";
}

} // namespace packtrace
