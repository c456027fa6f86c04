#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/image/exr.h"

namespace packtrace {

/// Role of a layer of an image in the denoiser.
enum class LayerRole : uint8_t { kAo, kDepth, kNormal, kMotion, kPreviousDepth, kAlbedo, kId, kHitDistance };
inline constexpr size_t kLayerRoleCount = 8;

/// A role and the layers that usually have it.
struct LayerRoleInfo {
  const char* name;         ///< as in reports: "ao"
  const char* option;       ///< names the layer on the command line: "--ao"
  uint32_t components;      ///< number of channels
  bool required;            ///< without it a picture cannot be denoised
  const char* help;         ///< what its values mean, without a full stop
  const char* usual_layers; ///< names in the order of preference, simplified (simple_layer_name()), separated by spaces
};

/// Descriptions of the roles, indexed by LayerRole.
std::span<const LayerRoleInfo, kLayerRoleCount> layer_roles();

/// Layers that the user names. A value is a layer ("ViewLayer.Normal", or its last part in any case), channels
/// separated by commas ("nx,ny,nz"), or "none" for a role that is not required.
using NamedLayers = std::array<std::optional<std::string>, kLayerRoleCount>;

/// The channels of a picture by role, as full names.
struct PictureChannels {
  std::array<std::vector<std::string>, kLayerRoleCount> by_role; ///< empty: the picture has none
  bool blender_motion = false; ///< the motion layer is Blender's, which points to the previous frame, with y upwards

  const std::vector<std::string>& of(LayerRole role) const { return by_role[static_cast<size_t>(role)]; }
  bool has(LayerRole role) const { return !of(role).empty(); }
};

/// Finds the channels for all roles: those that the user names, else those with a usual name. A picture without an AO
/// layer has its AO in its plain colour channels.
/// @param raw_ao whether a layer "ao_raw" is preferred to "ao"
/// @param file name for messages
/// Throws Error(kInput), which lists the channels, for a named layer that the picture does not have, and for a required
/// role without a layer.
PictureChannels find_picture_channels(const ExrInfo& info, const NamedLayers& named, bool raw_ao,
                                      std::string_view file);

/// Lower-case letters and digits of the last part of a layer's name: "ambientocclusion" for "View.Ambient_Occlusion".
std::string simple_layer_name(std::string_view layer);

} // namespace packtrace
