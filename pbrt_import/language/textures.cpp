#include "pbrt_import/language/textures.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

using Node = TextureGraph::Node;

/// A Texture directive being read.
struct TextureMaker {
  const Directive& directive;
  const TextureContext& context;
  TextureParameters parameters;
  bool is_float;

  Node operand(std::string_view name, float fallback) const {
    return is_float ? parameters.float_texture(name, fallback) : parameters.spectrum(name, Vec3(fallback));
  }
  Node constant(Vec3 value) const { return context.graph.constant(value); }
  Node constant_of(std::string_view name, float fallback) const {
    return is_float ? constant(Vec3(finite_float(name, fallback)))
                    : constant(parameters.constant_spectrum(name, Vec3(fallback)));
  }
  float finite_float(std::string_view name, float fallback) const {
    const float value = parameters.get_float(name, fallback);
    if (std::isfinite(value)) return value;
    context.reporter.error(directive.place, "parameter " + in_quotes("float " + std::string(name)) +
                                                " is not finite; its default is used");
    return fallback;
  }
};

TextureMapping read_mapping(const TextureMaker& maker) {
  const ParameterList& list = maker.directive.parameters;
  constexpr std::string_view kMappings[] = {"uv", "planar", "spherical", "cylindrical"};
  const std::string kind = list.get_string("mapping", "uv");
  TextureMapping mapping;
  mapping.is_uv = kind == "uv";
  if (mapping.is_uv) {
    mapping.scale = {list.get_float("uscale", 1.0f), list.get_float("vscale", 1.0f)};
    mapping.offset = {list.get_float("udelta", 0.0f), list.get_float("vdelta", 0.0f)};
  } else if (kind == "planar") {
    constexpr std::string_view kNames[] = {"v1", "v2", "udelta", "vdelta"};
    list.mark_used(kNames);
  } else if (kind != "spherical" && kind != "cylindrical") {
    maker.context.reporter.error(maker.directive.place, "unknown texture mapping " + in_quotes(kind) + "; uv is used" +
                                                            did_you_mean(closest_name(kind, kMappings)));
    mapping.is_uv = true;
  }
  return mapping;
}

/// Parameters that pbrt does not have: "string channel" "alpha" or "grey" with "float cutoff" makes a mask.
struct Channel {
  std::optional<float> alpha_cutoff, grey_cutoff;
};

Channel read_channel(const TextureMaker& maker) {
  const std::string name = maker.directive.parameters.get_string("channel", "rgb");
  Channel channel;
  if (name == "alpha")
    channel.alpha_cutoff = maker.finite_float("cutoff", 0.5f);
  else if (name == "grey")
    channel.grey_cutoff = maker.finite_float("cutoff", 0.5f);
  else if (name != "rgb")
    maker.context.reporter.error(maker.directive.place, "unknown channel " + in_quotes(name) + "; rgb is used");
  return channel;
}

std::optional<Node> make_imagemap(const TextureMaker& maker) {
  const TextureContext& context = maker.context;
  const ParameterList& list = maker.directive.parameters;
  constexpr std::string_view kFiltering[] = {"trilinear", "maxanisotropy"};
  list.mark_used(kFiltering);
  const TextureMapping mapping = read_mapping(maker);
  const float scale = maker.finite_float("scale", 1.0f);
  constexpr std::string_view kWraps[] = {"repeat", "black", "clamp"};
  WrapMode wrap = WrapMode::kRepeat;
  const std::string wrap_name = list.get_string("wrap", "repeat");
  if (wrap_name == "black")
    wrap = WrapMode::kBlack;
  else if (wrap_name == "clamp")
    wrap = WrapMode::kClamp;
  else if (wrap_name != "repeat")
    context.reporter.error(maker.directive.place, "unknown wrap mode " + in_quotes(wrap_name) + "; repeat is used" +
                                                      did_you_mean(closest_name(wrap_name, kWraps)));
  const Parameter* const file = list.find("filename", {ParameterType::kString});
  if (!file || file->strings.size() != 1) {
    context.reporter.error(maker.directive.place, "imagemap texture without a \"string filename\"; it counts as white");
    return maker.constant(Vec3(scale));
  }
  const std::filesystem::path path = context.file_names.resolve(file->strings[0], file->place, context.reporter);
  if (path.empty()) return maker.constant(Vec3(scale));
  // pbrt's rule: PNG and TGA images are sRGB-encoded by default.
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  const bool decode_srgb = list.get_bool("gamma", extension == ".png" || extension == ".tga");
  const Channel channel = read_channel(maker);
  const uint32_t image = context.graph.request_image(
      path, decode_srgb, maker.directive.place, context.reporter.sequence(), channel.alpha_cutoff, channel.grey_cutoff);
  std::error_code error;
  ImageRequest& request = context.graph.images()[image];
  request.embedded = context.file_names.embedded(path);
  if (!request.missing && request.embedded.empty() && !std::filesystem::is_regular_file(path, error)) {
    request.missing = true;
    const std::string name = in_quotes(path.string(), kMaxShownPath);
    context.reporter.error(file->place,
                           (std::filesystem::exists(path, error) ? "texture file " + name + " is not a regular file"
                                                                 : "no such texture file " + name) +
                               "; it counts as white");
  }
  return context.graph.image(image, Vec3(scale), wrap, mapping);
}

Node make_bilerp(const TextureMaker& maker) {
  read_mapping(maker);
  // The mean over the unit square is the mean of the corners.
  Vec3 corners[4];
  size_t count = 0;
  for (const auto& [name, fallback] : {std::pair{"v00", 0.0f}, {"v01", 1.0f}, {"v10", 0.0f}, {"v11", 1.0f}})
    corners[count++] = *maker.context.graph.constant_value(maker.constant_of(name, fallback));
  if (std::all_of(corners, corners + 4, [&](const Vec3& corner) { return corner == corners[0]; }))
    return maker.constant(corners[0]);
  return maker.context.graph.procedural((corners[0] + corners[1] + corners[2] + corners[3]) / 4.0f);
}

Node make_checkerboard(const TextureMaker& maker) {
  const ParameterList& list = maker.directive.parameters;
  const int32_t dimension = list.get_integer("dimension", 2);
  constexpr std::string_view kFiltering[] = {"aamode"};
  list.mark_used(kFiltering);
  TextureMapping mapping;
  if (dimension == 2)
    mapping = read_mapping(maker);
  else
    mapping.is_uv = false;
  if (dimension != 2 && dimension != 3)
    maker.context.reporter.error(maker.directive.place,
                                 std::to_string(dimension) + " dimensional checkerboard is not supported; taken as 3");
  return maker.context.graph.checkerboard(maker.operand("tex1", 1.0f), maker.operand("tex2", 0.0f), mapping);
}

Node make_dots(const TextureMaker& maker) {
  read_mapping(maker);
  // Every second cell has a disk of radius 0.35 somewhere inside it.
  constexpr float kInside = 0.5f * std::numbers::pi_v<float> * 0.35f * 0.35f;
  return maker.context.graph.mix(maker.operand("outside", 0.0f), maker.operand("inside", 1.0f),
                                 maker.context.graph.procedural(Vec3(kInside)));
}

Node make_mean(const TextureMaker& maker, Vec3 mean) {
  constexpr std::string_view kNames[] = {"octaves", "roughness", "scale", "variation"};
  maker.directive.parameters.mark_used(kNames);
  return maker.context.graph.procedural(mean);
}

std::optional<Node> make_by_class(const TextureMaker& maker, const std::string& kind) {
  TextureGraph& graph = maker.context.graph;
  if (kind == "constant") return maker.constant_of("value", 1.0f);
  if (kind == "scale") return graph.product(maker.operand("tex1", 1.0f), maker.operand("tex2", 1.0f));
  if (kind == "mix") {
    const Node a = maker.operand("tex1", 0.0f), b = maker.operand("tex2", 1.0f);
    return graph.mix(a, b, maker.parameters.float_texture("amount", 0.5f));
  }
  if (kind == "imagemap") return make_imagemap(maker);
  if (kind == "bilerp") return make_bilerp(maker);
  if (kind == "checkerboard") return make_checkerboard(maker);
  if (kind == "dots") return make_dots(maker);
  if (kind == "uv") {
    read_mapping(maker);
    return maker.constant(Vec3(0.5f, 0.5f, 0.0f));
  }
  // Approximate means of pbrt-v3's procedural textures at their default parameters, with negative values clamped to 0;
  // an average colour does not need more precision.
  if (kind == "fbm") return make_mean(maker, Vec3(maker.is_float ? 0.0f : 0.12f));
  if (kind == "wrinkled") return make_mean(maker, Vec3(0.4f));
  if (kind == "windy") return make_mean(maker, Vec3(0.03f));
  if (kind == "marble") return make_mean(maker, Vec3(0.80f, 0.80f, 0.84f));
  if (kind == "ptex") {
    constexpr std::string_view kNames[] = {"filename", "gamma"};
    maker.directive.parameters.mark_used(kNames);
    maker.context.reporter.warning(maker.directive.place, "ptex textures are not supported; 0.5 is used");
    return maker.constant(Vec3(0.5f));
  }
  constexpr std::string_view kClasses[] = {"constant",     "scale",  "mix", "imagemap", "bilerp",
                                           "checkerboard", "dots",   "uv",  "fbm",      "wrinkled",
                                           "windy",        "marble", "ptex"};
  maker.context.reporter.error(maker.directive.place,
                               "unknown texture class " + in_quotes(kind) + did_you_mean(closest_name(kind, kClasses)));
  return std::nullopt;
}

} // namespace

std::optional<TextureGraph::Node> make_texture(const Directive& directive, const TextureContext& context) {
  const std::string& type = directive.names[1];
  if (type != "float" && type != "spectrum" && type != "color") {
    constexpr std::string_view kTypes[] = {"float", "spectrum", "color"};
    context.reporter.error(directive.place, "unknown texture type " + in_quotes(type) +
                                                ", neither \"float\" nor \"spectrum\"" +
                                                did_you_mean(closest_name(type, kTypes)));
    return std::nullopt;
  }
  const bool is_float = type == "float";
  const ScopedNames& names = is_float ? context.state.float_textures : context.state.spectrum_textures;
  if (names.find(directive.names[0]))
    context.reporter.warning(directive.place, std::string(is_float ? "float" : "spectrum") + " texture " +
                                                  in_quotes(directive.names[0]) +
                                                  " is defined again; what follows uses the new one");
  const TextureMaker maker{directive, context, TextureParameters(context, directive.parameters), is_float};
  const std::optional<Node> node = make_by_class(maker, directive.names[2]);
  if (!node) return std::nullopt;
  report_unused(directive.parameters, context.reporter);
  context.graph.set_origin(*node, directive.names[0], directive.place);
  return node;
}

} // namespace packtrace
