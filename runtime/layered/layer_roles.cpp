#include "runtime/layered/layer_roles.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "pbrt_import/base/file_error.h"

namespace packtrace {
namespace {

/// Usual names: packtrace's own; Blender, Arnold, Karma, pbrt-v4, RenderMan, V-Ray, and the guides of other denoisers.
constexpr std::array<LayerRoleInfo, kLayerRoleCount> kRoles{{
    {"ao", "--ao", 1, true, "Noisy ambient occlusion, 1 = open; negative and non-finite values mean no sample",
     "ao ambientocclusion occlusion vrayambientocclusion"},
    {"depth", "--depth", 1, true, "Depth of the surface; 0, infinite and huge values are background",
     "depth z zdepth viewz hitpz pz linearz lineardepth vrayzdepth denoisingdepth raydistance distance"},
    {"normal", "--normal", 3, true,
     "Normal of the surface, in world space or any other that stays from picture to picture",
     "ns shadingnormal shadingnormals normal normals worldnormal hitn n nn nworld vraynormals denoisingnormal "
     "geometricnormal ng"},
    {"motion", "--motion", 2, false,
     "Pixels (x right, y down) from where the previous picture shows the surface to where this one does; see "
     "--motion-scale",
     "motion motionvector motionvectors mv vector velocity vrayvelocity"},
    {"previous_depth", "--previous-depth", 1, false, "Depth that the surface had in the previous picture",
     "previousdepth prevdepth"},
    {"albedo", "--albedo", 3, false, "Colour of the surface, for the layers albedo and shaded",
     "albedo diffusealbedo basecolor diffcol diffusecolor denoisingalbedo diffusefilter vraydiffusefilter"},
    {"id", "--id", 1, false, "Number of the object or instance; history does not pass from one to another",
     "instance instanceid objectid object indexob objectindex id cryptoobject00 vrayrenderid"},
    {"hit_distance", "--hit-distance", 1, false, "Mean distance to what occludes",
     "hitdistance aohitdistance aodistance"},
}};

/// Channels that share a name up to the last dot.
struct Group {
  std::string name;                  ///< empty: plain channels such as R and Z
  std::vector<std::string> channels; ///< full names
};

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// The component that a channel is of its layer: 'x' for "normal.X" and "X"; 0 if its whole name is that of a layer.
char component_of(std::string_view channel) {
  const size_t dot = channel.rfind('.');
  const std::string_view last = dot == std::string_view::npos ? channel : channel.substr(dot + 1);
  return last.size() == 1 && std::string_view("xyzwrgbauv").find(lower(last[0])) != std::string_view::npos
             ? lower(last[0])
             : '\0';
}

std::string group_of(const std::string& channel) {
  if (component_of(channel) == '\0') return channel;
  const size_t dot = channel.rfind('.');
  return dot == std::string::npos ? std::string() : channel.substr(0, dot);
}

std::vector<Group> groups_of(const ExrInfo& info) {
  std::vector<Group> groups;
  for (const ExrLayer& layer : info.layers)
    for (const ExrChannel& channel : layer.channels) {
      const std::string name = group_of(channel.name);
      auto found = std::ranges::find(groups, name, &Group::name);
      if (found == groups.end()) found = groups.insert(found, {name, {}});
      found->channels.push_back(channel.name);
    }
  return groups;
}

/// Channels of a group in the order of the components; empty if there are too few. Depth and other scalars may be
/// stored as colours with equal channels, of which the first is taken.
std::vector<std::string> components(const Group& group, uint32_t count) {
  if (group.name.empty() && count == 1) return {}; // plain channels are no layer
  for (const std::string_view order : {"xyz", "rgb", "uv"}) {
    std::vector<std::string> found;
    for (const char component : order.substr(0, count))
      for (const std::string& channel : group.channels)
        if (component_of(channel) == component) found.push_back(channel);
    if (found.size() == count) return found;
  }
  if (count == 1) return {group.channels.front()};
  return {};
}

std::string channel_list(const ExrInfo& info) {
  constexpr size_t kMaxNames = 48;
  std::string list;
  size_t count = 0;
  for (const ExrLayer& layer : info.layers)
    for (const ExrChannel& channel : layer.channels)
      if (++count <= kMaxNames) list.append(list.empty() ? "" : ", ").append(channel.name);
  return count > kMaxNames ? list + " and " + std::to_string(count - kMaxNames) + " more" : list;
}

bool has_channel(const std::vector<Group>& groups, const std::string& channel) {
  return std::ranges::any_of(
      groups, [&](const Group& group) { return std::ranges::find(group.channels, channel) != group.channels.end(); });
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

/// Channels of a layer, or of a list of channels, that the user names; empty if there is no such layer.
std::vector<std::string> named_channels(const std::vector<Group>& groups, const LayerRoleInfo& role,
                                        const std::string& name) {
  const std::vector<std::string> listed = split(name, ',');
  if (listed.size() == role.components &&
      std::ranges::all_of(listed, [&](const std::string& channel) { return has_channel(groups, channel); }))
    return listed;
  for (const Group& group : groups)
    if (group.name == name) return components(group, role.components);
  for (const Group& group : groups)
    if (!simple_layer_name(name).empty() && simple_layer_name(group.name) == simple_layer_name(name))
      return components(group, role.components);
  return {};
}

std::vector<std::string> usual_channels(const std::vector<Group>& groups, const LayerRoleInfo& role) {
  for (const std::string& usual : split(role.usual_layers, ' '))
    for (const Group& group : groups)
      if (simple_layer_name(group.name) == usual)
        if (std::vector<std::string> found = components(group, role.components); !found.empty()) return found;
  return {};
}

/// Plain channels and layers whose meaning depends on others.
std::vector<std::string> last_resort(const std::vector<Group>& groups, LayerRole role) {
  const auto first_of = [&](std::initializer_list<const char*> channels) -> std::vector<std::string> {
    for (const char* const channel : channels)
      if (has_channel(groups, channel)) return {channel};
    return {};
  };
  if (role == LayerRole::kAo) return first_of({"R", "Y"});
  if (role == LayerRole::kDepth) {
    if (std::vector<std::string> plain = first_of({"Z"}); !plain.empty()) return plain;
    if (has_channel(groups, "dzdx")) return first_of({"P.Z"}); // pbrt-v4's G-buffer: positions in camera space
  }
  return {};
}

bool is_blender_motion(const std::vector<std::string>& motion, const std::vector<Group>& groups) {
  if (motion.empty()) return false;
  const std::string name = group_of(motion.front());
  return simple_layer_name(name) == "vector" && has_channel(groups, name + ".W");
}

} // namespace

std::span<const LayerRoleInfo, kLayerRoleCount> layer_roles() { return kRoles; }

std::string simple_layer_name(std::string_view layer) {
  const size_t dot = layer.rfind('.');
  std::string simple;
  for (const char c : dot == std::string_view::npos ? layer : layer.substr(dot + 1))
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) simple += lower(c);
  return simple;
}

PictureChannels find_picture_channels(const ExrInfo& info, const NamedLayers& named, bool raw_ao,
                                      std::string_view file) {
  const std::vector<Group> groups = groups_of(info);
  const auto fail = [&](const std::string& what) {
    throw FileError(ErrorKind::kInput, std::string(file), what + "; its channels are " + channel_list(info));
  };
  PictureChannels result;
  for (size_t i = 0; i < kLayerRoleCount; ++i) {
    const LayerRoleInfo& role = kRoles[i];
    std::vector<std::string>& channels = result.by_role[i];
    if (named[i] == "none" && !role.required) continue;
    if (named[i]) {
      channels = named_channels(groups, role, *named[i]);
      if (channels.empty())
        fail(std::string(role.option) + " " + *named[i] + ": it has no such layer of " +
             std::to_string(role.components) + (role.components == 1 ? " channel" : " channels"));
      continue;
    }
    if (i == static_cast<size_t>(LayerRole::kAo) && raw_ao && has_channel(groups, "ao_raw")) channels = {"ao_raw"};
    if (channels.empty()) channels = usual_channels(groups, role);
    if (channels.empty()) channels = last_resort(groups, static_cast<LayerRole>(i));
    if (channels.empty() && role.required)
      fail(std::string("it has no layer for ") + role.name + " with a usual name, so name it with " + role.option);
  }
  result.blender_motion = is_blender_motion(result.of(LayerRole::kMotion), groups);
  return result;
}

} // namespace packtrace
