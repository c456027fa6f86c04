#include "pbrt_import/language/texture_graph.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

namespace packtrace {
namespace {

bool is_zero(Vec3 v) { return v.x == 0.0f && v.y == 0.0f && v.z == 0.0f; }

bool is_usable(const TextureMapping& mapping) {
  return mapping.is_uv && mapping.scale.x != 0.0f && mapping.scale.y != 0.0f && std::isfinite(mapping.scale.x) &&
         std::isfinite(mapping.scale.y) && std::isfinite(mapping.offset.x) && std::isfinite(mapping.offset.y);
}

glm::dvec2 mapped(glm::dvec2 uv, const TextureMapping& mapping) {
  return uv * glm::dvec2(mapping.scale) + glm::dvec2(mapping.offset);
}

/// Applies the wrap mode to texel coordinates; nullopt outside an image with black wrap.
/// @param x,y integer texel coordinates, possibly outside the image
std::optional<std::pair<uint32_t, uint32_t>> wrapped_texel(const ImageSummary& image, WrapMode wrap, double x,
                                                           double y) {
  const double w = image.width, h = image.height;
  if (wrap == WrapMode::kRepeat) x -= w * std::floor(x / w), y -= h * std::floor(y / h);
  if (wrap == WrapMode::kBlack && !(x >= 0.0 && x < w && y >= 0.0 && y < h)) return std::nullopt;
  return std::pair{static_cast<uint32_t>(std::clamp(x, 0.0, w - 1.0)),
                   static_cast<uint32_t>(std::clamp(y, 0.0, h - 1.0))};
}

bool texel_nonzero(const ImageSummary& image, WrapMode wrap, double x, double y) {
  const auto texel = wrapped_texel(image, wrap, x, y);
  if (!texel) return false;
  const auto [column, row] = *texel;
  return (image.nonzero[static_cast<size_t>(row) * AlphaMask::row_words(image.width) + column / 32] >> (column % 32)) &
         1u;
}

/// Resolution of textures that contain checkerboards but no image.
constexpr uint32_t kSampledMaskSize = 1024, kSampledTextureSize = 256;

} // namespace

TextureGraph::Node TextureGraph::add(const NodeData& data) {
  nodes_.push_back(data);
  return static_cast<Node>(nodes_.size() - 1);
}

TextureGraph::Node TextureGraph::constant(Vec3 value) {
  NodeData data;
  data.value = value;
  return add(data);
}

TextureGraph::Node TextureGraph::procedural(Vec3 mean) {
  NodeData data;
  data.kind = Kind::kProcedural;
  data.value = mean;
  return add(data);
}

TextureGraph::Node TextureGraph::image(uint32_t image, Vec3 scale, WrapMode wrap, const TextureMapping& mapping) {
  return add({Kind::kImage, wrap, image, 0, 0, scale, mapping});
}

TextureGraph::Node TextureGraph::product(Node a, Node b) {
  const Vec3 *const va = constant_value(a), *const vb = constant_value(b);
  if (va && vb) return constant(*va * *vb);
  return add({Kind::kProduct, {}, a, b, 0, Vec3(0.0f), {}});
}

TextureGraph::Node TextureGraph::mix(Node a, Node b, Node amount) {
  if (const Vec3* const t = constant_value(amount)) {
    if (is_zero(*t)) return a;
    if (*t == Vec3(1.0f)) return b;
    const Vec3 *const va = constant_value(a), *const vb = constant_value(b);
    if (va && vb) return constant((Vec3(1.0f) - *t) * *va + *t * *vb);
  }
  return add({Kind::kMix, {}, a, b, amount, Vec3(0.0f), {}});
}

TextureGraph::Node TextureGraph::checkerboard(Node a, Node b, const TextureMapping& mapping) {
  return add({Kind::kCheckerboard, {}, a, b, 0, Vec3(0.0f), mapping});
}

uint32_t TextureGraph::request_image(const std::filesystem::path& path, bool decode_srgb, const Place& place,
                                     uint64_t sequence, std::optional<float> alpha_cutoff,
                                     std::optional<float> grey_cutoff) {
  const auto [it, inserted] =
      image_numbers_.try_emplace({path, decode_srgb, alpha_cutoff, grey_cutoff}, static_cast<uint32_t>(images_.size()));
  if (inserted) {
    ImageRequest request;
    request.path = path;
    request.decode_srgb = decode_srgb;
    request.place = place;
    request.sequence = sequence;
    request.alpha_cutoff = alpha_cutoff;
    request.grey_cutoff = grey_cutoff;
    images_.push_back(std::move(request));
  }
  return it->second;
}

TextureGraph::Origin TextureGraph::origin(Node node) const {
  const auto found = origins_.find(node);
  return found == origins_.end() ? Origin{} : found->second;
}

const Vec3* TextureGraph::constant_value(Node node) const {
  return nodes_[node].kind == Kind::kConstant ? &nodes_[node].value : nullptr;
}

std::vector<TextureGraph::Node> TextureGraph::reachable(Node node) const {
  std::vector<Node> found, open{node};
  std::vector<uint8_t> seen(static_cast<size_t>(node) + 1, 0); // operands have smaller numbers
  while (!open.empty()) {
    const Node top = open.back();
    open.pop_back();
    if (seen[top]) continue;
    seen[top] = 1;
    found.push_back(top);
    const NodeData& data = nodes_[top];
    if (data.kind == Kind::kConstant || data.kind == Kind::kProcedural || data.kind == Kind::kImage) continue;
    open.push_back(data.a);
    open.push_back(data.b);
    if (data.kind == Kind::kMix) open.push_back(data.c);
  }
  std::sort(found.begin(), found.end());
  return found;
}

void TextureGraph::require(Node node, ImageWants wants) {
  if (nodes_[node].kind == Kind::kConstant) return;
  for (const Node n : reachable(node))
    if (nodes_[n].kind == Kind::kImage) {
      ImageRequest& image = images_[nodes_[n].a];
      image.needed = true;
      image.want_mask = image.want_mask || wants.mask;
      image.want_colours = image.want_colours || wants.colours;
    }
}

Vec3 TextureGraph::average(Node node) {
  while (averages_.size() <= node) {
    const NodeData& data = nodes_[averages_.size()];
    Vec3 value = data.value;
    switch (data.kind) {
    case Kind::kConstant:
    case Kind::kProcedural:
      break;
    case Kind::kImage:
      value *= images_[data.a].missing ? Vec3(1.0f) : images_[data.a].summary.average;
      break;
    case Kind::kProduct:
      value = averages_[data.a] * averages_[data.b];
      break;
    case Kind::kMix:
      value = (Vec3(1.0f) - averages_[data.c]) * averages_[data.a] + averages_[data.c] * averages_[data.b];
      break;
    case Kind::kCheckerboard:
      value = 0.5f * (averages_[data.a] + averages_[data.b]);
      break;
    }
    averages_.push_back(value);
  }
  return averages_[node];
}

bool TextureGraph::nonzero(const NodeData& data, glm::dvec2 uv, std::span<const uint8_t> operands) const {
  switch (data.kind) {
  case Kind::kConstant:
    return !is_zero(data.value);
  case Kind::kProcedural:
    return true;
  case Kind::kImage: {
    const ImageRequest& image = images_[data.a];
    if (is_zero(data.value)) return false;
    if (image.missing || !is_usable(data.mapping)) return true;
    // Looks up a single texel, because AlphaMaskView applies pbrt's bilinear footprint later.
    const glm::dvec2 st = mapped(uv, data.mapping);
    if (!std::isfinite(st.x) || !std::isfinite(st.y)) return true; // opaque, as in AlphaMaskView
    return texel_nonzero(image.summary, data.wrap, std::floor(st.x * image.summary.width),
                         std::floor((1.0 - st.y) * image.summary.height));
  }
  case Kind::kProduct:
    return operands[0] && operands[1];
  case Kind::kMix:
    return operands[0] || (operands[1] && operands[2]); // an amount of exactly 1 is not handled specially
  case Kind::kCheckerboard: {
    if (!is_usable(data.mapping)) return operands[0] || operands[1];
    const glm::dvec2 st = mapped(uv, data.mapping);
    const double cell = std::floor(st.x) + std::floor(st.y);
    return operands[cell - 2.0 * std::floor(cell / 2.0) == 0.0 ? 0 : 1];
  }
  }
  return true;
}

TextureGraph::MaskResult TextureGraph::alpha_mask(Node node) const {
  MaskResult result;
  const std::vector<Node> order = reachable(node);
  const NodeData* layout = nullptr; // the widest image, which sets the resolution
  const NodeData* board = nullptr;  // the checkerboard that sets the period if there is no image
  bool only_image_varies = true, sampled = false;
  for (const Node n : order) {
    const NodeData& data = nodes_[n];
    const bool is_image = data.kind == Kind::kImage && !images_[data.a].missing && !is_zero(data.value);
    if (data.kind == Kind::kProcedural || (is_image && !is_usable(data.mapping))) result.exact = false;
    if (is_image && is_usable(data.mapping)) {
      only_image_varies = only_image_varies && !layout;
      if (!layout || images_[data.a].summary.width > images_[layout->a].summary.width) layout = &data;
    }
    sampled = sampled || data.kind == Kind::kCheckerboard;
    if (data.kind == Kind::kCheckerboard && !board && is_usable(data.mapping)) board = &data;
  }
  result.exact = result.exact && !sampled && only_image_varies;
  AlphaMask& mask = result.mask;
  mask.width = layout ? images_[layout->a].summary.width : sampled ? kSampledMaskSize : 1;
  mask.height = layout ? images_[layout->a].summary.height : sampled ? kSampledMaskSize : 1;
  if (layout) {
    mask.wrap = layout->wrap, mask.uv_scale = layout->mapping.scale, mask.uv_offset = layout->mapping.offset;
  } else if (board) { // a checkerboard repeats every two cells
    mask.uv_scale = 0.5f * board->mapping.scale, mask.uv_offset = 0.5f * board->mapping.offset;
  }
  constexpr size_t kMaxEvaluatedNodes = 64;               // per texel
  constexpr uint64_t kMaxEvaluations = uint64_t{1} << 31; // a few seconds; unbounded, it could be hours
  if (order.size() > kMaxEvaluatedNodes || uint64_t{mask.width} * mask.height > kMaxEvaluations / order.size()) {
    result.exact = false;
    mask = {};
    return result;
  }
  if (order.size() == 1 && layout) { // the image's own texels
    mask.words = images_[layout->a].summary.nonzero;
  } else {
    mask.words.assign(static_cast<size_t>(AlphaMask::row_words(mask.width)) * mask.height, 0);
    rasterize<uint8_t>(
        order, mask,
        [&](Node n, glm::dvec2 uv, std::span<const uint8_t> operands) -> uint8_t {
          return nonzero(nodes_[n], uv, operands);
        },
        [&](uint32_t x, uint32_t y, uint8_t opaque) {
          if (opaque != 0)
            mask.words[static_cast<size_t>(y) * AlphaMask::row_words(mask.width) + x / 32] |= 1u << (x % 32);
        });
  }
  size_t set = 0;
  for (const uint32_t word : mask.words) set += static_cast<size_t>(std::popcount(word));
  const size_t all = static_cast<size_t>(mask.width) * mask.height;
  // Everything outside an image with black wrap is 0, so an opaque image has holes as well.
  const bool all_set = set == all && !(layout && mask.wrap == WrapMode::kBlack);
  result.kind = set == 0 ? MaskKind::kAllHoles : all_set ? MaskKind::kNoHoles : MaskKind::kSomeHoles;
  if (result.kind != MaskKind::kSomeHoles) mask = {};
  return result;
}

/// Evaluates the nodes at each texel's centre, operands first, and passes the last node's result to `put`.
template <class Value, class Texture, class Evaluate, class Put>
void TextureGraph::rasterize(std::span<const Node> order, const Texture& texture, const Evaluate& evaluate,
                             const Put& put) const {
  std::vector<Value> results(order.size());
  const auto slot = [&](Node n) {
    return static_cast<size_t>(std::lower_bound(order.begin(), order.end(), n) - order.begin());
  };
  std::vector<std::array<size_t, 3>> operand_slots(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    const NodeData& data = nodes_[order[i]];
    if (data.kind == Kind::kProduct || data.kind == Kind::kMix || data.kind == Kind::kCheckerboard)
      operand_slots[i] = {slot(data.a), slot(data.b), data.kind == Kind::kMix ? slot(data.c) : 0};
  }
  for (uint32_t y = 0; y < texture.height; ++y)
    for (uint32_t x = 0; x < texture.width; ++x) {
      const glm::dvec2 st((x + 0.5) / texture.width, 1.0 - (y + 0.5) / texture.height);
      const glm::dvec2 uv = (st - glm::dvec2(texture.uv_offset)) / glm::dvec2(texture.uv_scale);
      for (size_t i = 0; i < order.size(); ++i) {
        const std::array<size_t, 3>& from = operand_slots[i];
        const std::array<Value, 3> operands{results[from[0]], results[from[1]], results[from[2]]};
        results[i] = evaluate(order[i], uv, std::span<const Value>(operands));
      }
      put(x, y, results.back());
    }
}

Vec3 TextureGraph::image_colour(Node node, glm::dvec2 uv) const {
  const NodeData& data = nodes_[node];
  const ImageRequest& image = images_[data.a];
  const glm::dvec2 st = mapped(uv, data.mapping);
  if (image.missing || !is_usable(data.mapping) || !std::isfinite(st.x) || !std::isfinite(st.y)) return averages_[node];
  const auto texel = wrapped_texel(image.summary, data.wrap, std::floor(st.x * image.summary.width),
                                   std::floor((1.0 - st.y) * image.summary.height));
  if (!texel) return Vec3(0.0f);
  const uint8_t* const rgb =
      image.summary.rgb.data() + (static_cast<size_t>(texel->second) * image.summary.width + texel->first) * 3;
  const std::array<float, 256>& linear = linear_of_srgb8();
  return data.value * Vec3(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
}

Vec3 TextureGraph::colour(Node node, glm::dvec2 uv, std::span<const Vec3> operands) const {
  const NodeData& data = nodes_[node];
  switch (data.kind) {
  case Kind::kConstant:
  case Kind::kProcedural:
    return data.value;
  case Kind::kImage:
    return image_colour(node, uv);
  case Kind::kProduct:
    return operands[0] * operands[1];
  case Kind::kMix:
    return (Vec3(1.0f) - operands[2]) * operands[0] + operands[2] * operands[1];
  case Kind::kCheckerboard: {
    if (!is_usable(data.mapping)) return averages_[node];
    const glm::dvec2 st = mapped(uv, data.mapping);
    const double cell = std::floor(st.x) + std::floor(st.y);
    return operands[cell - 2.0 * std::floor(cell / 2.0) == 0.0 ? 0 : 1];
  }
  }
  return data.value;
}

std::optional<AlbedoTexture> TextureGraph::albedo_texture(Node node, MemoryReservation& memory) {
  average(node); // computes the averages of all nodes up to this one
  const std::vector<Node> order = reachable(node);
  const NodeData *layout = nullptr, *board = nullptr; // as in alpha_mask()
  for (const Node n : order) {
    const NodeData& data = nodes_[n];
    if (data.kind == Kind::kImage && !images_[data.a].missing && is_usable(data.mapping)) {
      if (images_[data.a].summary.rgb.empty()) return std::nullopt;
      if (!layout || images_[data.a].summary.width > images_[layout->a].summary.width) layout = &data;
    }
    if (data.kind == Kind::kCheckerboard && !board && is_usable(data.mapping)) board = &data;
  }
  if (!layout && !board) return std::nullopt;
  AlbedoTexture texture;
  texture.name = origin(node).name;
  texture.width = texture.height = kSampledTextureSize;
  if (layout) {
    texture.width = images_[layout->a].summary.width, texture.height = images_[layout->a].summary.height;
    texture.wrap = layout->wrap, texture.uv_scale = layout->mapping.scale, texture.uv_offset = layout->mapping.offset;
  } else {
    texture.uv_scale = 0.5f * board->mapping.scale, texture.uv_offset = 0.5f * board->mapping.offset;
  }
  const uint64_t texels = uint64_t{texture.width} * texture.height;
  constexpr size_t kMaxEvaluatedNodes = 64;               // per texel
  constexpr uint64_t kMaxEvaluations = uint64_t{1} << 28; // a few seconds; unbounded, it could be minutes
  if (order.size() > kMaxEvaluatedNodes || texels > kMaxTextureTexels || texels > kMaxEvaluations / order.size())
    return std::nullopt;
  if (texels * order.size() > evaluations_left_) return texture;
  memory.resize(memory.bytes() + 3 * texels, "the textures of materials");
  if (order.size() == 1 && nodes_[node].value == Vec3(1.0f)) {
    texture.rgb = images_[layout->a].summary.rgb;
    return texture;
  }
  evaluations_left_ -= texels * order.size();
  texture.rgb.resize(static_cast<size_t>(texels) * 3);
  uint8_t* to = texture.rgb.data();
  rasterize<Vec3>(
      order, texture, [&](Node n, glm::dvec2 uv, std::span<const Vec3> operands) { return colour(n, uv, operands); },
      [&](uint32_t, uint32_t, Vec3 value) {
        for (int c = 0; c < 3; ++c) *to++ = srgb8_of_linear(value[c]);
      });
  return texture;
}

} // namespace packtrace
