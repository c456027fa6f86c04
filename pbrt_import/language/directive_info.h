#pragma once

#include <cstdint>
#include <string_view>

namespace packtrace {

enum class DirectiveKind : uint8_t {
  kAccelerator,
  kActiveTransform,
  kAreaLightSource,
  kAttributeBegin,
  kAttributeEnd,
  kCamera,
  kConcatTransform,
  kCoordSysTransform,
  kCoordinateSystem,
  kFilm,
  kIdentity,
  kInclude, ///< never leaves the parser
  kIntegrator,
  kLightSource,
  kLookAt,
  kMakeNamedMaterial,
  kMakeNamedMedium,
  kMaterial,
  kMediumInterface,
  kNamedMaterial,
  kObjectBegin,
  kObjectEnd,
  kObjectInstance,
  kPixelFilter,
  kReverseOrientation,
  kRotate,
  kSampler,
  kScale,
  kShape,
  kTexture,
  kTransform,
  kTransformBegin,
  kTransformEnd,
  kTransformTimes,
  kTranslate,
  kWorldBegin,
  kWorldEnd,
};

/// What a keyword takes.
struct DirectiveInfo {
  std::string_view keyword;
  DirectiveKind kind;
  uint8_t numbers = 0;
  uint8_t names = 0; ///< in quotes
  bool parameters = false;
};

/// Null for words that are no directive.
const DirectiveInfo* find_directive(std::string_view keyword);
/// The keyword that word is most likely a misspelling of; empty: none.
std::string_view closest_directive(std::string_view word);

} // namespace packtrace
