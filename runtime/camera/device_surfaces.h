#pragma once

#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/view_tracer.h"

namespace packtrace {

/// Fills the G-buffer with surfaces that the tracer makes of the hits of gbuffer.on_gpu: those of trace_primary(), bit
/// for bit. Returns false where the tracer cannot make them: for channels of GBufferChannel, surfaces that moved,
/// environment cameras, and if there is no memory for them.
/// @param gbuffer its arrays have their sizes
bool make_device_surfaces(const ViewTracer& tracer, const PrimaryCamera& now, const PreviousFrame& previous,
                          GBuffer& gbuffer);

/// Fills in the arrays that stayed on a GPU (GBuffer::guides_on_gpu).
void read_device_guides(const ViewTracer& tracer, GBuffer& gbuffer);

/// Reads points that stayed on a GPU (GBuffer::points_on_gpu) into the arrays of another G-buffer, with the shading
/// normals.
void read_device_points(const ViewTracer& tracer, const GBuffer& gbuffer, GBuffer& out);

} // namespace packtrace
