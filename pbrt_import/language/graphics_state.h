#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/language/name_table.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

inline constexpr uint32_t kNone = ~0u;

/// Names that stand for numbers, where blocks give back what was visible before them. Opening a block costs nothing
/// however many names there are; closing one costs the definitions made inside it.
class ScopedNames {
public:
  /// @param value not kNone
  void define(std::string_view name, uint32_t value);
  std::optional<uint32_t> find(std::string_view name) const;
  /// The visible name that name is most likely a misspelling of; empty: none.
  std::string_view closest(std::string_view name) const;

  size_t mark() const { return undo_.size(); }
  void restore(size_t mark);

private:
  struct Undo {
    uint32_t name;
    uint32_t previous;
  };
  NameTable names_;
  std::vector<uint32_t> values_; ///< by name; kNone: not visible
  std::vector<Undo> undo_;
};

/// The transform at the start and at the end of the shutter.
struct TransformPair {
  DAffine start{1.0};
  DAffine end{1.0};
  bool known = true; ///< false: a directive that should have changed it was ignored
};

/// What AttributeBegin saves, names apart.
struct Attributes {
  uint32_t material = kNone;   ///< MaterialLibrary's number; kNone: pbrt's default, grey matte
  uint32_t area_light = kNone; ///< 1: emits from both sides, 0: from the front
  bool reverse_orientation = false;
};

enum class BlockKind : uint8_t { kAttribute, kTransform, kObject };
std::string_view begin_keyword(BlockKind kind);
std::string_view end_keyword(BlockKind kind);

/// One open Begin.
struct Block {
  BlockKind kind = BlockKind::kAttribute;
  uint8_t active = 3;
  Place place;
  Attributes attributes;
  TransformPair transform;
  size_t named_materials = 0;
  size_t float_textures = 0;
  size_t spectrum_textures = 0;
};

/// pbrt-v3's graphics state with its stack of blocks, which lives on the heap.
class GraphicsState {
public:
  Attributes attributes;
  ScopedNames named_materials;   ///< to MaterialLibrary numbers
  ScopedNames float_textures;    ///< to TextureGraph numbers
  ScopedNames spectrum_textures; ///< to TextureGraph numbers

  const TransformPair& transform() const { return transform_; }
  bool animated() const { return animated_ && transform_.start != transform_.end; }

  /// Applies a map, before all earlier ones in the order points see it, to the active transforms.
  void concatenate(const DAffine& map);
  void set_transform(const DAffine& map);
  void set_transform(const TransformPair& pair);
  void reset_transform();
  /// A directive that should have changed the transform is ignored.
  void lose_transform() { transform_.known = false; }
  /// Bit 0: start, bit 1: end.
  void set_active(uint8_t bits) { active_ = bits, animated_ = true; }

  void open_block(BlockKind kind, const Place& place);
  /// Closes the innermost block. There must be one.
  void close_block();
  const std::vector<Block>& blocks() const { return blocks_; }

private:
  TransformPair transform_;
  uint8_t active_ = 3;
  bool animated_ = false; ///< ActiveTransform was ever used
  std::vector<Block> blocks_;
};

} // namespace packtrace
