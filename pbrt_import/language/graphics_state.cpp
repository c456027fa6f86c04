#include "pbrt_import/language/graphics_state.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "pbrt_import/language/transforms.h"

namespace packtrace {

void ScopedNames::define(std::string_view name, uint32_t value) {
  const uint32_t number = names_.intern(name);
  if (number == values_.size()) values_.push_back(kNone);
  undo_.push_back({number, values_[number]});
  values_[number] = value;
}

std::optional<uint32_t> ScopedNames::find(std::string_view name) const {
  const std::optional<uint32_t> number = names_.find(name);
  if (!number || values_[*number] == kNone) return std::nullopt;
  return values_[*number];
}

std::string_view ScopedNames::closest(std::string_view name) const {
  return names_.closest(name, [this](uint32_t number) { return values_[number] != kNone; });
}

void ScopedNames::restore(size_t mark) {
  while (undo_.size() > mark) {
    values_[undo_.back().name] = undo_.back().previous;
    undo_.pop_back();
  }
}

std::string_view begin_keyword(BlockKind kind) {
  constexpr std::string_view kKeywords[] = {"AttributeBegin", "TransformBegin", "ObjectBegin"};
  return kKeywords[static_cast<size_t>(kind)];
}

std::string_view end_keyword(BlockKind kind) {
  constexpr std::string_view kKeywords[] = {"AttributeEnd", "TransformEnd", "ObjectEnd"};
  return kKeywords[static_cast<size_t>(kind)];
}

void GraphicsState::concatenate(const DAffine& map) {
  linear_ = Linear::kUnknown;
  if (active_ & 1) transform_.start = compose(transform_.start, map);
  if (animated_ && (active_ & 2)) transform_.end = compose(transform_.end, map);
}

void GraphicsState::translate(DVec3 offset) {
  if (animated_) return concatenate(translation(offset));
  if (linear_ == Linear::kUnknown) {
    // A product with the identity adds zeros of any sign to each number, which only change -0, and NaN of infinities.
    const auto kept = [](double v) { return std::isfinite(v) && !(v == 0.0 && std::signbit(v)); };
    linear_ = Linear::kKept;
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row)
        if (!kept(transform_.start[column][row])) linear_ = Linear::kOther;
  }
  if (linear_ == Linear::kOther) return concatenate(translation(offset));
  transform_.start[3] = transform_point(transform_.start, offset);
}

void GraphicsState::set_active(uint8_t bits) {
  if (!animated_) { // the ends have not been kept up to date
    transform_.end = transform_.start;
    for (Block& block : blocks_) block.transform.end = block.transform.start;
  }
  active_ = bits;
  animated_ = true;
}

void GraphicsState::set_transform(const DAffine& map) {
  linear_ = Linear::kUnknown;
  if (active_ & 1) transform_.start = map;
  if (active_ & 2) transform_.end = map;
  if (active_ == 3) transform_.known = true;
}

void GraphicsState::set_transform(const TransformPair& pair) {
  linear_ = Linear::kUnknown;
  transform_ = pair;
}

void GraphicsState::reset_transform() {
  linear_ = Linear::kUnknown;
  transform_ = {};
  active_ = 3;
}

void GraphicsState::open_block(BlockKind kind, const Place& place) {
  blocks_.push_back({kind, active_, place, attributes, transform_, named_materials.mark(), float_textures.mark(),
                     spectrum_textures.mark()});
}

void GraphicsState::close_block() {
  assert(!blocks_.empty());
  const Block& block = blocks_.back();
  linear_ = Linear::kUnknown;
  transform_ = block.transform;
  active_ = block.active;
  if (block.kind != BlockKind::kTransform) {
    attributes = block.attributes;
    named_materials.restore(block.named_materials);
    float_textures.restore(block.float_textures);
    spectrum_textures.restore(block.spectrum_textures);
  }
  blocks_.pop_back();
}

} // namespace packtrace
