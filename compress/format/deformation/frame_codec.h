#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compress/format/deformation/frame_vertices.h"
#include "compress/format/layout/bit_stream.h"

/// One frame of one cluster as bit fields: the residuals of a prediction. Each frame chooses its prediction:
///
///   symbol  bits  meaning
///   kind    2     0 the file's vertices, 1 the frame before, 2 linear: twice the frame before less the one before that
///   spatial 1     1: residuals are differences to the residual of the vertex before (0 before the first)
///   then per axis, x, y, z:
///   width   5     of the fields, 0..31
///   size    6     bits of the anchor
///   anchor  size  zigzag: the smallest residual
///   fields  one per vertex in `width` bits: the residual less the anchor
///
/// All sums are modulo 2^32. Kind 1 needs a frame before in the same group, kind 2 two. The first frame of a group thus
/// depends on the file's vertices only.
/// Source of the prediction from earlier frames: Ibarria and Rossignac, "Dynapack: space-time compression of the 3D
/// animations of triangle meshes with fixed connectivity" (2003).
namespace packtrace {

/// A vertex in a frame, as FramePoint.
using FrameVertex = std::array<uint32_t, 3>;

enum class FramePrediction : uint32_t { kStored, kPrevious, kLinear };

/// What a frame may be predicted from. All spans have an element per vertex of the cluster; earlier frames are empty
/// where the group has none.
struct FrameReferences {
  std::span<const FrameVertex> stored;          ///< the file's vertices
  std::span<const FrameVertex> previous, older; ///< one frame before, two frames before
};

/// Appends a frame in the form that takes the fewest bits.
/// Needs coordinates in 0..kMaxFrameExtent.
void encode_frame(std::span<const FrameVertex> vertices, const FrameReferences& references, BitWriter& writer);

/// Reads a frame that skip_frame() accepted and returns the bit after it.
/// @param bits 8 bytes behind the frame are readable
/// @param out may be the same vertices as references.older
uint64_t decode_frame(const uint8_t* bits, uint64_t bit, const FrameReferences& references, std::span<FrameVertex> out);

/// Whether a frame is predicted from the file's vertices; decode_frame() reads references.stored only then.
inline bool uses_stored(const uint8_t* bits, uint64_t bit) { return read_bits(bits, bit, 2) == 0; }

/// Returns the bit after a frame, or 0 if the bits are not those of a frame.
/// @param end bits before this one belong to the stream; 8 more bytes are readable
/// @param before number of earlier frames of the group
uint64_t skip_frame(const uint8_t* bits, uint64_t bit, uint64_t end, uint32_t vertex_count, uint32_t before);

} // namespace packtrace
