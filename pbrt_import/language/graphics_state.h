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

/// Maps names to numbers with block scope: closing a block restores the definitions that were visible before it.
/// Opening a block costs O(1); closing one costs O(definitions made inside it).
class ScopedNames {
public:
  /// @param value not kNone
  void define(std::string_view name, uint32_t value);
  std::optional<uint32_t> find(std::string_view name) const;
  /// Visible name that `name` is most likely a misspelling of; empty if none is close.
  std::string_view closest(std::string_view name) const;

  size_t mark() const { return undo_.size(); }
  void restore(size_t mark);

private:
  struct Undo {
    uint32_t name;
    uint32_t previous;
  };
  NameTable names_;
  std::vector<uint32_t> values_; ///< indexed by the name's number; kNone: not visible
  std::vector<Undo> undo_;
};

/// The current transform at the start and at the end of the shutter interval.
struct TransformPair {
  DAffine start{1.0};
  DAffine end{1.0};
  bool known = true; ///< false: a directive that changes the transform had to be ignored
};

/// The state that AttributeBegin saves, apart from names and transforms.
struct Attributes {
  uint32_t material = kNone;   ///< number in MaterialLibrary; kNone: pbrt's default, grey matte
  uint32_t area_light = kNone; ///< 1: emits from both sides, 0: from the front; kNone: no light
  uint32_t emission = kNone;   ///< radiance in MaterialLibrary; kNone: no light, or shading is not kept
  bool reverse_orientation = false;
};

enum class BlockKind : uint8_t { kAttribute, kTransform, kObject };
std::string_view begin_keyword(BlockKind kind);
std::string_view end_keyword(BlockKind kind);

/// An open block, with the state to restore when it closes.
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

/// pbrt-v3's graphics state and its stack of open blocks, which is on the heap so that deep nesting is safe.
class GraphicsState {
public:
  Attributes attributes;
  ScopedNames named_materials;   ///< MaterialLibrary numbers
  ScopedNames float_textures;    ///< TextureGraph numbers
  ScopedNames spectrum_textures; ///< TextureGraph numbers

  TransformPair transform() const {
    return {transform_.start, animated_ ? transform_.end : transform_.start, transform_.known};
  }
  const DAffine& start_transform() const { return transform_.start; }
  bool transform_known() const { return transform_.known; }
  bool animated() const { return animated_ && transform_.start != transform_.end; }

  /// Multiplies the active transforms by `map` from the right: points are mapped by `map` first.
  void concatenate(const DAffine& map);
  /// concatenate() with a translation by a finite offset, bit for bit.
  void translate(DVec3 offset);
  void set_transform(const DAffine& map);
  void set_transform(const TransformPair& pair);
  void reset_transform();
  /// Marks the transform as unknown, because a directive that changes it had to be ignored.
  void mark_transform_unknown() { transform_.known = false; }
  /// Selects the transforms that later directives change: bit 0 is the start, bit 1 the end.
  void set_active(uint8_t bits);

  void open_block(BlockKind kind, const Place& place);
  /// Closes the innermost block and restores its state. Precondition: a block is open.
  void close_block();
  const std::vector<Block>& blocks() const { return blocks_; }

private:
  /// Whether products of the linear part with 1 and sums with 0 keep all its bits.
  enum class Linear : uint8_t { kUnknown, kKept, kOther };

  TransformPair transform_; ///< its end, and those of blocks_, only count if animated_
  uint8_t active_ = 3;
  Linear linear_ = Linear::kUnknown; ///< of transform_.start
  bool animated_ = false;            ///< whether ActiveTransform was ever used
  std::vector<Block> blocks_;
};

} // namespace packtrace
