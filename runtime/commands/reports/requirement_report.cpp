#include "runtime/commands/reports/requirement_report.h"

#include <array>
#include <bit>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/scene/material_flag_names.h"
#include "runtime/commands/reports/file_report.h"
#include "runtime/commands/reports/proxy_report.h"

namespace packtrace {
namespace {

constexpr std::array<std::string_view, baked::kStreamCount> kStreamNames{"normals", "uv", "tangents"};
constexpr std::array<std::string_view, baked::kPurposeCount> kPurposeNames{"ao", "shading"};

uint32_t purpose_of(const FileSummary& s) { return s.bake.purpose & ((1u << baked::kKeepShift) - 1); }

bool kept_on_request(const FileSummary& s, uint32_t stream) {
  return (s.bake.purpose >> baked::kKeepShift >> stream & 1u) != 0;
}

/// Material flags that a purpose reads: AO only those that affect visibility, shading all.
MaterialFlags flags_read(uint32_t purpose) {
  constexpr MaterialFlags kVisibility =
      kAlphaMask | kShadowAlphaMask | kTransmissive | kInvisible | kAbsent | kNoShadow;
  return purpose == baked::kAo ? kVisibility : kAllMaterialFlags;
}

/// The decision about a stream and its reason, as the first part of a report line.
std::string decision(uint32_t stream, uint32_t reason, uint32_t purpose) {
  const std::string name(kStreamNames[stream]);
  switch (reason) {
  case baked::kAbsent:
    return stream == baked::kTangents ? "tangents not needed: no normal map" : name + ": the source has none";
  case baked::kUnused:
    if (stream == baked::kNormals) return "normals dropped: the surface is invisible to camera rays";
    if (stream == baked::kTangents) return "tangents not needed: ao does not use normal maps";
    return purpose == baked::kAo ? "uv dropped: no masked material" : "uv dropped: no textured or masked material";
  case baked::kInferred:
    return name + " dropped: equal to the face normals";
  case baked::kForMask:
    return name + " kept: used by alpha masks";
  case baked::kForTexture:
    return name + " kept: used by textures";
  case baked::kForNormalMap:
    return stream == baked::kTangents ? "tangents needed by normal maps, but not stored: derive them from uv"
                                      : name + " kept: used by normal maps";
  case baked::kForShading:
    return name + " kept: different from the face normals";
  case baked::kOnRequest:
    return name + " kept: requested by --keep";
  default:
    return name;
  }
}

bool dropped(const baked::RequirementRecord& r) {
  return (r.reason == baked::kUnused || r.reason == baked::kInferred) && r.source_bytes > 0;
}

std::string sentence(const baked::RequirementRecord& r, uint32_t purpose) {
  std::string text = decision(r.stream, r.reason, purpose) +
                     fmt::format(grouped(), ", {:L} triangles of {:L} geometries", r.triangles, r.geometries);
  if (r.source_bytes == 0) return text;
  if (dropped(r)) return text + fmt::format(grouped(), ", {:L} source bytes saved", r.source_bytes);
  return text + fmt::format(grouped(), ", {:L} source bytes stored as {:L}", r.source_bytes, (r.stored_bits + 7) / 8);
}

int bits_for(uint32_t count) { return count > 0 ? std::bit_width(count - 1) : 0; }

std::string materials_sentence(const FileSummary& s) {
  const MaterialFlags read = s.material_flags & flags_read(purpose_of(s));
  return fmt::format(grouped(),
                     "materials: {:L} of {:L} in use, at most {:L} per geometry ({} bits); flags in use: {} ({} of {} "
                     "bits); flags that "
                     "{} uses: {}",
                     s.materials_in_use, s.materials, s.max_slots, bits_for(s.max_slots),
                     material_flag_words(s.material_flags), std::popcount(s.material_flags), kMaterialFlagNames.size(),
                     kPurposeNames[purpose_of(s)], material_flag_words(read));
}

std::string sentence(const GeometryUse& use, uint32_t purpose) {
  std::string text = fmt::format(grouped(), "  {}: triangles {:L}   instances {:L}   materials {:L}",
                                 use.name.empty() ? "(no name)" : use.name, use.triangles, use.instances, use.slots);
  for (uint32_t stream = 0; stream < baked::kStreamCount; ++stream) {
    bool stored = false;
    for (uint32_t reason = 0; reason < baked::kReasonCount; ++reason) {
      if ((use.requirements & baked::requirement_bit(stream, reason)) == 0) continue;
      if (stream == baked::kTangents && reason == baked::kAbsent) continue; // holds for nearly all geometries
      text += "; " + decision(stream, reason, purpose);
      stored |= reason > baked::kInferred;
    }
    if (!stored || stream == baked::kTangents) continue;
    const bool normals = stream == baked::kNormals;
    text += fmt::format(grouped(), " ({:L} triangles, {:L} bytes)", normals ? use.normal_triangles : use.uv_triangles,
                        ((normals ? use.normal_bits : use.uv_bits) + 7) / 8);
  }
  return text;
}

constexpr std::array<std::string_view, baked::kReasonCount> kReasonNames{
    "absent", "unused", "inferred", "mask", "texture", "normal_map", "shading", "request"};

nlohmann::json to_json(const GeometryUse& use) {
  nlohmann::json json = {{"name", use.name},
                         {"triangles", use.triangles},
                         {"instances", use.instances},
                         {"materials", use.slots},
                         {"normal_triangles", use.normal_triangles},
                         {"uv_triangles", use.uv_triangles},
                         {"normal_bytes", (use.normal_bits + 7) / 8},
                         {"uv_bytes", (use.uv_bits + 7) / 8}};
  for (uint32_t stream = 0; stream < baked::kStreamCount; ++stream) {
    nlohmann::json reasons = nlohmann::json::array();
    for (uint32_t reason = 0; reason < baked::kReasonCount; ++reason)
      if ((use.requirements & baked::requirement_bit(stream, reason)) != 0) reasons.push_back(kReasonNames[reason]);
    json["reasons"][std::string(kStreamNames[stream])] = std::move(reasons);
  }
  return json;
}

} // namespace

std::string requirements_text(const FileSummary& s, bool by_geometry) {
  const uint32_t purpose = purpose_of(s);
  std::string text = fmt::format("required for {}:\n", kPurposeNames[purpose]);
  for (const baked::RequirementRecord& row : s.requirements) text += "  " + sentence(row, purpose) + "\n";
  if (const std::string proxies = proxies_requirement(s); !proxies.empty()) text += "  " + proxies + "\n";
  text += "  " + materials_sentence(s) + "\n";
  if (!by_geometry) return text;
  text += "by geometry:\n";
  for (const GeometryUse& use : s.by_geometry) text += sentence(use, purpose) + "\n";
  return text;
}

std::string dropped_streams_text(const FileSummary& s) {
  std::string text;
  for (const baked::RequirementRecord& row : s.requirements)
    if (dropped(row)) text += sentence(row, purpose_of(s)) + "\n";
  return text;
}

nlohmann::json requirements_json(const FileSummary& s, bool by_geometry) {
  const uint32_t purpose = purpose_of(s);
  nlohmann::json json = {{"for", kPurposeNames[purpose]}, {"keep", nlohmann::json::array()}};
  for (uint32_t stream = 0; stream < baked::kStreamCount; ++stream)
    if (kept_on_request(s, stream)) json["keep"].push_back(kStreamNames[stream]);
  json["streams"] = nlohmann::json::array();
  for (const baked::RequirementRecord& row : s.requirements)
    json["streams"].push_back({{"stream", kStreamNames[row.stream]},
                               {"reason", kReasonNames[row.reason]},
                               {"says", sentence(row, purpose)},
                               {"geometries", row.geometries},
                               {"triangles", row.triangles},
                               {"source_bytes", row.source_bytes},
                               {"stored_bytes", (row.stored_bits + 7) / 8}});
  nlohmann::json flags = nlohmann::json::array();
  for (size_t i = 0; i < kMaterialFlagNames.size(); ++i)
    if ((s.material_flags >> i & 1u) != 0) flags.push_back(kMaterialFlagNames[i]);
  json["materials"] = {{"in_use", s.materials_in_use}, {"most_in_a_geometry", s.max_slots}, {"flags", flags}};
  if (!by_geometry) return json;
  json["geometries"] = nlohmann::json::array();
  for (const GeometryUse& use : s.by_geometry) json["geometries"].push_back(to_json(use));
  return json;
}

nlohmann::json dropped_streams_json(const FileSummary& s) {
  nlohmann::json json = nlohmann::json::array();
  for (const baked::RequirementRecord& row : s.requirements)
    if (dropped(row))
      json.push_back({{"stream", kStreamNames[row.stream]},
                      {"reason", decision(row.stream, row.reason, purpose_of(s))},
                      {"bytes_saved", row.source_bytes}});
  return json;
}

} // namespace packtrace
