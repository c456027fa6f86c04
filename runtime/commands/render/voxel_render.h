#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "runtime/commands/render/render_options.h"
#include "runtime/frame/frame_loop.h"

namespace packtrace {

/// Whether the options select a view of proxies.
bool views_proxies(const RenderOptions& options);

/// Runs `render --view voxels`: a picture of a file's voxels, their colour times the share of occlusion rays that reach
/// the radius. Returns the exit code. Throws Error(kUsage) for options that this view does not have,
/// Error(kUnsupported) for files without proxies.
int render_proxies(const RenderOptions& options, const GlobalOptions& globals);

/// What --proxy-beyond did, for the key `proxies` of --json.
nlohmann::json used_proxies_json(const FrameConfig& config, const FrameLoop& loop);

/// The same as a line of text.
std::string used_proxies_text(const nlohmann::json& used);

} // namespace packtrace
