#pragma once

#include "runtime/commands/render_options.h"

namespace packtrace {

/// Whether the options ask for a view of proxies.
bool views_proxies(const RenderOptions& options);

/// Runs `render --view voxels`: a picture of a file's voxels, their colour times the share of occlusion rays that reach
/// the radius. Returns the exit code. Throws Error(kUsage) for options that this view does not have,
/// Error(kUnsupported) for files without proxies.
int render_proxies(const RenderOptions& options, const GlobalOptions& globals);

} // namespace packtrace
