#include "pbrt_import/texture_graph.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

bool is_zero(Vec3 v) { return v.x == 0.0f && v.y == 0.0f && v.z == 0.0f; }

bool is_usable(const TextureMapping& mapping) {
  return mapping.is_uv && mapping.scale.x != 0.0f && mapping.scale.y != 0.0f && std::isfinite(mapping.scale.x) &&
         std::isfinite(mapping.scale.y) && std::isfinite(mapping.offset.x) && std::isfinite(mapping.offset.y);
}

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
                                     uint64_t sequence) {
  const auto [it, inserted] = image_numbers_.try_emplace({path, decode_srgb}, static_cast<uint32_t>(images_.size()));
  if (inserted) {
    ImageRequest request;
    request.path = path;
    request.decode_srgb = decode_srgb;
    request.place = place;
    request.sequence = sequence;
    images_.push_back(std::move(request));
  }
  return it->second;
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
    if (data.kind == Kind::kConstant || data.kind == Kind::kImage) continue;
    open.push_back(data.a);
    open.push_back(data.b);
    if (data.kind == Kind::kMix) open.push_back(data.c);
  }
  std::sort(found.begin(), found.end());
  return found;
}

void TextureGraph::require(Node node, bool want_mask) {
  if (nodes_[node].kind == Kind::kConstant) return;
  for (const Node n : reachable(node))
    if (nodes_[n].kind == Kind::kImage) {
      ImageRequest& image = images_[nodes_[n].a];
      image.needed = true;
      image.want_mask = image.want_mask || want_mask;
    }
}

Vec3 TextureGraph::average(Node node) {
  while (averages_.size() <= node) {
    const NodeData& data = nodes_[averages_.size()];
    Vec3 value = data.value;
    switch (data.kind) {
    case Kind::kConstant: break;
    case Kind::kImage: value *= images_[data.a].missing ? Vec3(1.0f) : images_[data.a].summary.average; break;
    case Kind::kProduct: value = averages_[data.a] * averages_[data.b]; break;
    case Kind::kMix:
      value = (Vec3(1.0f) - averages_[data.c]) * averages_[data.a] + averages_[data.c] * averages_[data.b];
      break;
    case Kind::kCheckerboard: value = 0.5f * (averages_[data.a] + averages_[data.b]); break;
    }
    averages_.push_back(value);
  }
  return averages_[node];
}

bool TextureGraph::nonzero(const NodeData& data, Vec2 uv, std::span<const uint8_t> operands) const {
  switch (data.kind) {
  case Kind::kConstant: return !is_zero(data.value);
  case Kind::kImage: {
    const ImageRequest& image = images_[data.a];
    if (is_zero(data.value)) return false;
    if (image.missing || !is_usable(data.mapping)) return true;
    // The texel itself, not pbrt's bilinear neighbourhood: AlphaMaskView looks at that.
    const Vec2 st = uv * data.mapping.scale + data.mapping.offset;
    const double x = std::floor(static_cast<double>(st.x) * image.summary.width);
    const double y = std::floor((1.0 - static_cast<double>(st.y)) * image.summary.height);
    const AlphaMask mask{image.summary.width, image.summary.height, data.wrap, Vec2(1.0f), Vec2(0.0f), {}};
    AlphaMaskView texels = view(mask);
    texels.words = image.summary.nonzero;
    const Vec2 centre((static_cast<float>(x) + 0.5f) / static_cast<float>(mask.width),
                      1.0f - (static_cast<float>(y) + 0.5f) / static_cast<float>(mask.height));
    return texels.opaque(centre);
  }
  case Kind::kProduct: return operands[0] && operands[1];
  case Kind::kMix: return operands[0] || (operands[1] && operands[2]);
  case Kind::kCheckerboard: {
    if (!is_usable(data.mapping)) return operands[0] || operands[1];
    const Vec2 st = uv * data.mapping.scale + data.mapping.offset;
    const double cell = std::floor(st.x) + std::floor(st.y);
    return operands[cell - 2.0 * std::floor(cell / 2.0) == 0.0 ? 0 : 1];
  }
  }
  return true;
}
