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
  kInclude, ///< handled by the parser, never passed on
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

/// Arguments that a directive keyword takes.
struct DirectiveInfo {
  std::string_view keyword;
  DirectiveKind kind;
  uint8_t numbers = 0;
  uint8_t names = 0; ///< quoted strings
  bool parameters = false;
};

/// Looks up a directive by keyword; null if the word is not a directive.
const DirectiveInfo* find_directive(std::string_view keyword);
/// Directive keyword that `word` is most likely a misspelling of; empty if none is close.
std::string_view closest_directive(std::string_view word);

} // namespace packtrace
