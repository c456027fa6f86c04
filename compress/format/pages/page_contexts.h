#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace packtrace {

/// Streams of a page that `info` reports separately.
enum class PageStream : uint32_t { kTopology, kPositions, kNormals, kUvs, kRecords, kCount };
inline constexpr uint32_t kPageStreams = static_cast<uint32_t>(PageStream::kCount);

/// Numbers of the adaptive models that code symbols. PageModel documents the selection of a model within a range.
namespace context {
inline constexpr uint32_t kStripCorner = 0, kFirstCorner = 1, kSecondCorner = 2, kThirdCorner = 3; // kinds of corners
// 4 states of open edges x 8 counts of triangles at each of two corners
inline constexpr uint32_t kTurn = 0;
// 12 states of the guesses x 8 counts of triangles at the second corner x 4 at the first
inline constexpr uint32_t kStripNaming = kTurn + 256;
// 3 corners of a strip's first triangle x 12 states of the guesses
inline constexpr uint32_t kNaming = kStripNaming + 384;
inline constexpr uint32_t kVersion = kNaming + 36;
inline constexpr uint32_t kVertexAtPointBack = kVersion + 1;
inline constexpr uint32_t kBack = kVertexAtPointBack + 1; // 4 kinds of corners
inline constexpr uint32_t kPageBack = kBack + 4;
inline constexpr uint32_t kRepeats = kPageBack + 1; // by the flag of the last cluster
// 6 names that the same vertex had in the last cluster x 12 states of the guesses
inline constexpr uint32_t kRepeatedNaming = kRepeats + 2;
inline constexpr uint32_t kWidths = 46;
inline constexpr uint32_t kPosition = kRepeatedNaming + 72;    // expected width, in halves
inline constexpr uint32_t kPositionNear = kPosition + kWidths; // 24 widths of nearby errors x 16 expected errors
// without guess: 2 kinds of surroundings x 20 spans x 3 levels of surprise
inline constexpr uint32_t kPositionAlone = kPositionNear + 384;
// 3 kinds of the last vertex x 3 counts of known x 3 of other candidates
inline constexpr uint32_t kNormalChoice = kPositionAlone + 120;
inline constexpr uint32_t kNormalSeam = kNormalChoice + 27;
inline constexpr uint32_t kNormalX = kNormalSeam + 1; // 16 sizes of the expected error
inline constexpr uint32_t kNormalY = kNormalX + 16;   // 16 widths of the difference in x
inline constexpr uint32_t kUv = kNormalY + 16;        // 2 axes
inline constexpr uint32_t kSameMaterial = kUv + 2;
inline constexpr uint32_t kHasNormals = kSameMaterial + 1; // by the value for the last cluster
inline constexpr uint32_t kHasUvs = kHasNormals + 2;       // by the value for the last cluster
inline constexpr uint32_t kFull = kHasUvs + 2;
inline constexpr uint32_t kNormalChart = kFull + 1;
inline constexpr uint32_t kNormalPalette = kNormalChart + 1;
inline constexpr uint32_t kCount = kNormalPalette + 1;
} // namespace context

/// Returns the stream that a model's symbols and the bit fields behind them are counted in.
constexpr PageStream page_stream_of(uint32_t number) {
  if (number < context::kPosition) return PageStream::kTopology;
  if (number < context::kNormalChoice) return PageStream::kPositions;
  if (number < context::kUv) return PageStream::kNormals;
  return number < context::kSameMaterial ? PageStream::kUvs : PageStream::kRecords;
}

} // namespace packtrace
