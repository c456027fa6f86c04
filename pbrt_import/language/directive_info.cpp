#include "pbrt_import/language/directive_info.h"

#include <array>
#include <iterator>
#include <vector>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/equal_text.h"

namespace packtrace {
namespace {

using K = DirectiveKind;

constexpr DirectiveInfo kInfos[] = {
    {"Accelerator", K::kAccelerator, 0, 1, true},
    {"ActiveTransform", K::kActiveTransform, 0, 1, false},
    {"AreaLightSource", K::kAreaLightSource, 0, 1, true},
    {"AttributeBegin", K::kAttributeBegin},
    {"AttributeEnd", K::kAttributeEnd},
    {"Camera", K::kCamera, 0, 1, true},
    {"ConcatTransform", K::kConcatTransform, 16},
    {"CoordSysTransform", K::kCoordSysTransform, 0, 1, false},
    {"CoordinateSystem", K::kCoordinateSystem, 0, 1, false},
    {"Film", K::kFilm, 0, 1, true},
    {"Identity", K::kIdentity},
    {"Include", K::kInclude, 0, 1, false},
    {"Integrator", K::kIntegrator, 0, 1, true},
    {"LightSource", K::kLightSource, 0, 1, true},
    {"LookAt", K::kLookAt, 9},
    {"MakeNamedMaterial", K::kMakeNamedMaterial, 0, 1, true},
    {"MakeNamedMedium", K::kMakeNamedMedium, 0, 1, true},
    {"Material", K::kMaterial, 0, 1, true},
    {"MediumInterface", K::kMediumInterface, 0, 2, false},
    {"NamedMaterial", K::kNamedMaterial, 0, 1, false},
    {"ObjectBegin", K::kObjectBegin, 0, 1, false},
    {"ObjectEnd", K::kObjectEnd},
    {"ObjectInstance", K::kObjectInstance, 0, 1, false},
    {"PixelFilter", K::kPixelFilter, 0, 1, true},
    {"ReverseOrientation", K::kReverseOrientation},
    {"Rotate", K::kRotate, 4},
    {"Sampler", K::kSampler, 0, 1, true},
    {"Scale", K::kScale, 3},
    {"Shape", K::kShape, 0, 1, true},
    {"Texture", K::kTexture, 0, 3, true},
    {"Transform", K::kTransform, 16},
    {"TransformBegin", K::kTransformBegin},
    {"TransformEnd", K::kTransformEnd},
    {"TransformTimes", K::kTransformTimes, 2},
    {"Translate", K::kTranslate, 3},
    {"WorldBegin", K::kWorldBegin},
    {"WorldEnd", K::kWorldEnd},
};
static_assert(std::size(kInfos) == 37);

constexpr size_t kSlots = 128;

/// Hash of a word in constant time: it reads three characters and the length, and has few collisions among the
/// keywords.
constexpr size_t slot_of(std::string_view word) {
  const auto letter = [&](size_t i) { return static_cast<size_t>(static_cast<unsigned char>(word[i])); };
  return (letter(0) * 5 + letter(word.size() / 2) * 11 + letter(word.size() - 1) * 3 + word.size() * 17) % kSlots;
}

/// Open-addressing table: index into kInfos plus one, 0 for a free slot.
constexpr std::array<uint8_t, kSlots> make_slots() {
  std::array<uint8_t, kSlots> slots{};
  for (size_t i = 0; i < std::size(kInfos); ++i) {
    size_t slot = slot_of(kInfos[i].keyword);
    while (slots[slot] != 0) slot = (slot + 1) % kSlots;
    slots[slot] = static_cast<uint8_t>(i + 1);
  }
  return slots;
}

} // namespace

const DirectiveInfo* find_directive(std::string_view keyword) {
  static constexpr std::array<uint8_t, kSlots> kSlotTable = make_slots();
  if (keyword.empty()) return nullptr;
  for (size_t slot = slot_of(keyword); kSlotTable[slot] != 0; slot = (slot + 1) % kSlots)
    if (equal_text(kInfos[kSlotTable[slot] - 1].keyword, keyword)) return &kInfos[kSlotTable[slot] - 1];
  return nullptr;
}

std::string_view closest_directive(std::string_view word) {
  std::vector<std::string_view> keywords;
  for (const DirectiveInfo& info : kInfos) keywords.push_back(info.keyword);
  return closest_name(word, keywords);
}

} // namespace packtrace
