#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pbrt_import/files/image_file.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/albedo_texture.h"

namespace packtrace {

/// Texture mapping: st = uv * scale + offset, or another mapping (spherical, planar, ...), for which only the texture's
/// average is known.
struct TextureMapping {
  Vec2 scale{1.0f};
  Vec2 offset{0.0f};
  bool is_uv = true;
};

/// An image file that textures use. There is one request per file, colour encoding and cutoffs.
struct ImageRequest {
  std::filesystem::path path;
  bool decode_srgb = false;
  Place place;           ///< position of the first texture that uses it
  uint64_t sequence = 0; ///< Reporter::sequence() of that texture's directive
  bool needed = false;   ///< a used material depends on it
  bool want_mask = false;
  bool want_colours = false;
  bool want_radiance = false;          ///< set by users of request_image()
  std::optional<float> alpha_cutoff;   ///< as in ImageWants
  std::optional<float> grey_cutoff;    ///< as in ImageWants
  std::span<const std::byte> embedded; ///< content of an image within another file; empty: path is a file
  bool missing = false;                ///< missing or unreadable: counts as 1 everywhere, as in pbrt
  ImageSummary summary;                ///< filled in by FileLoader
  MemoryReservation memory;            ///< for the summary
};

/// All textures of a scene as expressions over constants and images. The operands of a node have smaller numbers.
/// Values are known once the images that require() marks have been read.
class TextureGraph {
public:
  using Node = uint32_t;

  Node constant(Vec3 value);
  Node procedural(Vec3 mean); ///< varies in an unmodelled way, with this mean; never exactly 0
  Node image(uint32_t image, Vec3 scale, WrapMode wrap, const TextureMapping& mapping);
  Node product(Node a, Node b);
  Node mix(Node a, Node b, Node amount); ///< (1 - amount) a + amount b
  Node checkerboard(Node a, Node b, const TextureMapping& mapping);

  /// Returns the index of the request with this path and encoding, which image() takes; adds it if there is none.
  uint32_t request_image(const std::filesystem::path& path, bool decode_srgb, const Place& place, uint64_t sequence,
                         std::optional<float> alpha_cutoff = std::nullopt,
                         std::optional<float> grey_cutoff = std::nullopt);
  std::vector<ImageRequest>& images() { return images_; }

  /// The Texture directive that defined a node.
  struct Origin {
    std::string name;
    Place place;
  };
  /// Sets the origin of a node; the first call per node wins.
  void set_origin(Node node, const std::string& name, const Place& place) { origins_.try_emplace(node, name, place); }
  /// Origin of a node; without a name if no directive defined it.
  Origin origin(Node node) const;

  /// The value of a constant node; null for all other nodes.
  const Vec3* constant_value(Node node) const;

  /// Marks the images that a node depends on as needed, and adds to what is wanted of them.
  void require(Node node, ImageWants wants);

  /// Mean over the texture's domain; the mean of a product is approximated by the product of the means.
  Vec3 average(Node node);

  /// Classifies where a texture is exactly 0, which is pbrt's alpha test.
  enum class MaskKind { kNoHoles, kAllHoles, kSomeHoles };
  struct MaskResult {
    MaskKind kind = MaskKind::kNoHoles;
    AlphaMask mask;    ///< only set for kSomeHoles
    bool exact = true; ///< false: sampled, or with holes ignored that do not depend on uv alone
  };
  MaskResult alpha_mask(Node node) const;

  /// The colours over uv, sampled at the texels of the widest image. Textures without a uv mapping contribute their
  /// average. Returns nullopt if the colours do not depend on uv, if an image's colours were not kept, if there are
  /// more than kMaxTextureTexels texels, or if the expression is too large to evaluate. Returns a texture without
  /// texels once the scene's budget of evaluations is used up.
  /// @param memory grows by the texels
  /// Throws MemoryError.
  std::optional<AlbedoTexture> albedo_texture(Node node, MemoryReservation& memory);

private:
  /// Remaining node evaluations at texels, for all textures of the scene.
  uint64_t evaluations_left_ = uint64_t{1} << 32;
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
  std::vector<Vec3> averages_; ///< averages of the first nodes, extended on demand
  std::unordered_map<Node, Origin> origins_;
  std::vector<ImageRequest> images_;
  std::map<std::tuple<std::filesystem::path, bool, std::optional<float>, std::optional<float>>, uint32_t>
      image_numbers_;
};

} // namespace packtrace
