#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pbrt_import/files/image_file.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// st = uv * scale + offset, or something else (spherical, planar ...) of which only averages can be told.
struct TextureMapping {
  Vec2 scale{1.0f};
  Vec2 offset{0.0f};
  bool is_uv = true;
};

/// An image file that textures name. One per file and colour encoding.
struct ImageRequest {
  std::filesystem::path path;
  bool decode_srgb = false;
  Place place;           ///< of the first texture that names it
  uint64_t sequence = 0; ///< of that texture's directive
  bool needed = false;   ///< something visible depends on it
  bool want_mask = false;
  bool want_colours = false;
  bool missing = false; ///< no such file, or unreadable: counts as 1 everywhere, as in pbrt
  ImageSummary summary; ///< filled in by whoever reads the files
  MemoryReservation memory; ///< of the summary
};

/// All textures of a scene as expressions over constants and images. A node only refers to nodes made before it. Values
/// are known once the images that require() asks for have been read.
class TextureGraph {
public:
  using Node = uint32_t;

  Node constant(Vec3 value);
  Node procedural(Vec3 mean); ///< varies in a way that only its mean is known of; not 0 anywhere
  Node image(uint32_t image, Vec3 scale, WrapMode wrap, const TextureMapping& mapping);
  Node product(Node a, Node b);
  Node mix(Node a, Node b, Node amount); ///< (1 - amount) a + amount b
  Node checkerboard(Node a, Node b, const TextureMapping& mapping);

  /// Number for image(): the request with this path and encoding, made if there is none.
  uint32_t request_image(const std::filesystem::path& path, bool decode_srgb, const Place& place, uint64_t sequence);
  std::vector<ImageRequest>& images() { return images_; }

  /// A Texture directive that stands for a node.
  struct Origin {
    std::string name;
    Place place;
  };
  /// The first origin of a node stays.
  void set_origin(Node node, const std::string& name, const Place& place) { origins_.try_emplace(node, name, place); }
  /// Nameless for nodes that no directive stands for.
  Origin origin(Node node) const;

  /// The value, where it is the same everywhere and no image has to be read for it.
  const Vec3* constant_value(Node node) const;

  /// Marks the images behind node as needed, and what is wanted of them.
  void require(Node node, ImageWants wants);

  /// Mean over the texture's domain; of a product the product of means.
  Vec3 average(Node node);

  /// Where the texture is exactly 0, as pbrt's alpha test asks.
  enum class MaskKind { kNoHoles, kAllHoles, kSomeHoles };
  struct MaskResult {
    MaskKind kind = MaskKind::kNoHoles;
    AlphaMask mask;    ///< for kSomeHoles
    bool exact = true; ///< false: sampled, or holes ignored because they cannot be told from uv
  };
  MaskResult alpha_mask(Node node) const;

  /// The colours over uv, sampled at the texels of the widest image; nothing where uv does not change them, where an
  /// image's colours were not kept, or there are more than kMostTextureTexels. What has no uv counts with its average.
  /// Without texels where all textures so far took too many evaluations.
  /// @param memory grows by the texels
  /// Throws MemoryError.
  std::optional<AlbedoTexture> albedo_texture(Node node, MemoryReservation& memory);

private:
  uint64_t evaluations_left_ = uint64_t{1} << 32; ///< of nodes at texels, for the textures of a scene
  enum class Kind : uint8_t { kConstant, kProcedural, kImage, kProduct, kMix, kCheckerboard };
  struct NodeData {
    Kind kind = Kind::kConstant;
    WrapMode wrap = WrapMode::kRepeat;
    uint32_t a = 0, b = 0, c = 0; ///< operands; kImage: a is the image
    Vec3 value{0.0f};             ///< kConstant: the value; kProcedural: the mean; kImage: the scale
    TextureMapping mapping;
  };
  Node add(const NodeData& data);
  std::vector<Node> reachable(Node node) const;
  template <class Value, class Texture, class Evaluate, class Put>
  void rasterize(std::span<const Node> order, const Texture& texture, const Evaluate& evaluate, const Put& put) const;
  bool nonzero(const NodeData& data, glm::dvec2 uv, std::span<const uint8_t> operands) const;
  Vec3 colour(Node node, glm::dvec2 uv, std::span<const Vec3> operands) const;
  Vec3 image_colour(Node node, glm::dvec2 uv) const;

  std::vector<NodeData> nodes_;
  std::vector<Vec3> averages_; ///< of the first nodes; grows on demand
  std::unordered_map<Node, Origin> origins_;
  std::vector<ImageRequest> images_;
  std::map<std::pair<std::filesystem::path, bool>, uint32_t> image_numbers_;
};

} // namespace packtrace
