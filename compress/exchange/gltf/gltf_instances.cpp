#include "compress/exchange/gltf/gltf_instances.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>

#include <glm/gtc/quaternion.hpp>
#include <meshoptimizer.h>

namespace packtrace {
namespace {

DVec3 to_dvec3(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

DAffine map_of(const InstanceTransform& t) {
  const glm::dquat q(double{t.rotation[3]}, double{t.rotation[0]}, double{t.rotation[1]}, double{t.rotation[2]});
  const glm::dmat3 turn = glm::mat3_cast(glm::normalize(q));
  return DAffine(turn[0] * double{t.scale[0]}, turn[1] * double{t.scale[1]}, turn[2] * double{t.scale[2]},
                 to_dvec3(t.translation));
}

DVec3 corner(const Bounds& box, int i) {
  return {i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z};
}

/// Rounds vectors to integers times a power of two of at most max_step, or as fine as 24 bits allow.
std::vector<std::byte> round_vectors(std::vector<InstanceTransform>& transforms,
                                     std::array<float, 3> InstanceTransform::* member, double max_step) {
  double largest = 0.0;
  for (const InstanceTransform& t : transforms)
    for (const float value : t.*member) largest = std::max(largest, std::abs(double{value}));
  constexpr double kFinest = -120.0, kCoarsest = 100.0; // the exponents of floats
  const double needed = largest > 0.0 ? std::ceil(std::log2(largest / static_cast<double>(kMaxMantissa))) : kFinest;
  const double wanted = std::floor(std::log2(std::max(max_step, std::numeric_limits<double>::min())));
  const auto exponent = static_cast<int>(std::clamp(std::max(needed, wanted), kFinest, kCoarsest));
  std::vector<int64_t> mantissas;
  mantissas.reserve(transforms.size() * 3);
  for (InstanceTransform& t : transforms)
    for (float& value : t.*member) {
      mantissas.push_back(std::llrint(std::ldexp(double{value}, -exponent)));
      value = static_cast<float>(std::ldexp(static_cast<double>(mantissas.back()), exponent));
    }
  return exponential(mantissas, exponent);
}

template <class Member>
std::vector<std::byte> raw_values(const std::vector<InstanceTransform>& transforms, Member member) {
  std::vector<std::byte> bytes;
  for (const InstanceTransform& t : transforms) {
    const auto raw = std::as_bytes(std::span(t.*member));
    bytes.insert(bytes.end(), raw.begin(), raw.end());
  }
  return bytes;
}

/// Rounds rotations to quaternions of 16-bit integers; returns what the filter QUATERNION stores.
std::vector<std::byte> round_rotations(std::vector<InstanceTransform>& transforms, int bits) {
  std::vector<std::array<float, 4>> quaternions;
  for (const InstanceTransform& t : transforms) quaternions.push_back(t.rotation);
  std::vector<std::array<int16_t, 4>> codes(transforms.size());
  meshopt_encodeFilterQuat(codes.data(), codes.size(), sizeof(codes[0]), bits, quaternions[0].data());
  std::vector<std::array<int16_t, 4>> decoded = codes;
  meshopt_decodeFilterQuat(decoded.data(), decoded.size(), sizeof(decoded[0]));
  constexpr float kUnit = 32767.0f;
  for (size_t i = 0; i < decoded.size(); ++i)
    for (size_t k = 0; k < 4; ++k) transforms[i].rotation[k] = static_cast<float>(decoded[i][k]) / kUnit;
  std::vector<std::byte> bytes(codes.size() * sizeof(codes[0]));
  std::memcpy(bytes.data(), codes.data(), bytes.size());
  return bytes;
}

} // namespace

std::optional<InstanceTransform> decompose_instance(const DAffine& map) {
  const glm::dmat3 linear(map);
  DVec3 scale(glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2]));
  if (!(scale.x > 0.0 && scale.y > 0.0 && scale.z > 0.0)) return std::nullopt;
  if (glm::determinant(linear) < 0.0) scale.x = -scale.x;
  const glm::dmat3 turn(linear[0] / scale.x, linear[1] / scale.y, linear[2] / scale.z);
  const glm::dquat q = glm::normalize(glm::quat_cast(turn));
  InstanceTransform result;
  for (int i = 0; i < 3; ++i) {
    result.translation[static_cast<size_t>(i)] = static_cast<float>(map[3][i]);
    result.scale[static_cast<size_t>(i)] = static_cast<float>(scale[i]);
  }
  result.rotation = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z),
                     static_cast<float>(q.w)};
  const DAffine again = map_of(result);
  double error = 0.0, size = 0.0;
  for (int c = 0; c < 3; ++c) {
    error = std::max(error, glm::length(again[c] - linear[c]));
    size = std::max(size, glm::length(linear[c]));
  }
  constexpr double kTolerance = 4e-6;
  return error <= kTolerance * size ? std::optional(result) : std::nullopt;
}

InstanceAttributes::InstanceAttributes(std::span<const DAffine> world_from_stored)
    : maps_(world_from_stored.begin(), world_from_stored.end()) {
  for (const DAffine& map : maps_) transforms_.push_back(*decompose_instance(map));
}

uint64_t InstanceAttributes::add_floats(GltfModel& model, GltfJson& attributes) const {
  uint64_t bytes = 0;
  const InstanceTransform identity;
  const auto add = [&](const char* name, const char* type, const auto member, bool keep) {
    std::vector<std::decay_t<decltype(identity.*member)>> values;
    for (const InstanceTransform& transform : transforms_) values.push_back(transform.*member);
    if (!keep && std::ranges::all_of(values, [&](const auto& value) { return value == identity.*member; })) return;
    const auto raw = std::as_bytes(std::span(values));
    bytes += raw.size();
    attributes[name] = model.add("accessors", {{"bufferView", model.add_view(raw, 0)},
                                               {"componentType", kGltfFloat},
                                               {"count", values.size()},
                                               {"type", type}});
  };
  add("TRANSLATION", "VEC3", &InstanceTransform::translation, true);
  add("ROTATION", "VEC4", &InstanceTransform::rotation, false);
  add("SCALE", "VEC3", &InstanceTransform::scale, false);
  return bytes;
}

/// Orders instances along a space-filling curve, so that neighbours have similar values.
void InstanceAttributes::sort() {
  std::vector<std::array<float, 3>> places;
  for (const InstanceTransform& t : transforms_) places.push_back(t.translation);
  std::vector<unsigned> remap(places.size());
  meshopt_spatialSortRemap(remap.data(), places[0].data(), places.size(), sizeof(places[0]));
  std::vector<DAffine> maps(maps_.size());
  std::vector<InstanceTransform> transforms(maps_.size());
  for (size_t i = 0; i < remap.size(); ++i) maps[remap[i]] = maps_[i], transforms[remap[i]] = transforms_[i];
  maps_ = std::move(maps), transforms_ = std::move(transforms);
}

double InstanceAttributes::displacement(const std::vector<InstanceTransform>& rounded, const Bounds& stored) const {
  double largest = 0.0;
  for (size_t i = 0; i < maps_.size(); ++i) {
    const DAffine map = map_of(rounded[i]);
    for (int c = 0; c < 8; ++c)
      largest = std::max(largest, glm::distance(transform_point(map, corner(stored, c)),
                                                transform_point(maps_[i], corner(stored, c))));
  }
  return largest;
}

/// Rounds rotations to the fewest bits that move no corner by more than the tolerance, or else to floats of 24 bits.
InstanceAttributes::Coded InstanceAttributes::code_rotations(const Bounds& stored, double tolerance,
                                                             std::vector<InstanceTransform>& rounded) const {
  for (const int bits : {10, 12, 14, 16}) {
    std::vector<InstanceTransform> turned = transforms_;
    std::vector<std::byte> codes = round_rotations(turned, bits);
    if (displacement(turned, stored) > tolerance) continue;
    for (size_t i = 0; i < turned.size(); ++i) rounded[i].rotation = turned[i].rotation;
    return {{8, 0, "QUATERNION"},
            std::move(codes),
            {{"type", "VEC4"}, {"componentType", kGltfShort}, {"normalized", true}}};
  }
  constexpr int kExponent = -22;
  std::vector<int64_t> mantissas;
  for (InstanceTransform& t : rounded)
    for (float& value : t.rotation) {
      mantissas.push_back(std::llrint(std::ldexp(double{value}, -kExponent)));
      value = static_cast<float>(std::ldexp(static_cast<double>(mantissas.back()), kExponent));
    }
  return {{16, 0, "EXPONENTIAL"}, exponential(mantissas, kExponent), {{"type", "VEC4"}, {"componentType", kGltfFloat}}};
}

double InstanceAttributes::add_coded(const Bounds& stored, MeshoptStreams& streams, GltfJson& attributes) {
  sort();
  double unit = std::numeric_limits<double>::infinity(), radius = 1.0;
  for (const InstanceTransform& t : transforms_)
    for (const float scale : t.scale) unit = std::min(unit, std::abs(double{scale}));
  for (int c = 0; c < 8; ++c) radius = std::max(radius, glm::length(corner(stored, c)));
  const double tolerance = 0.25 * unit; // of a stored unit, in world units
  std::vector<InstanceTransform> rounded = transforms_;
  const GltfJson vectors{{"type", "VEC3"}, {"componentType", kGltfFloat}};
  std::map<std::string, Coded> coded;
  coded["TRANSLATION"] = {
      {12, 0, "EXPONENTIAL"}, round_vectors(rounded, &InstanceTransform::translation, tolerance), vectors};
  coded["ROTATION"] = code_rotations(stored, tolerance, rounded);
  coded["SCALE"] = {
      {12, 0, "EXPONENTIAL"}, round_vectors(rounded, &InstanceTransform::scale, tolerance / radius), vectors};
  // Sizes and distances that no common exponent suits stay floats.
  constexpr double kMaxUnits = 2.0;
  double moved = displacement(rounded, stored);
  if (!(moved <= kMaxUnits * unit)) {
    rounded = transforms_;
    moved = displacement(rounded, stored);
    coded["TRANSLATION"] = {{12, 0, {}}, raw_values(rounded, &InstanceTransform::translation), vectors};
    coded["ROTATION"] = {{16, 0, {}},
                         raw_values(rounded, &InstanceTransform::rotation),
                         {{"type", "VEC4"}, {"componentType", kGltfFloat}}};
    coded["SCALE"] = {{12, 0, {}}, raw_values(rounded, &InstanceTransform::scale), vectors};
  }
  const InstanceTransform identity;
  if (std::ranges::all_of(transforms_, [&](const auto& t) { return t.rotation == identity.rotation; }))
    coded.erase("ROTATION");
  if (std::ranges::all_of(transforms_, [&](const auto& t) { return t.scale == identity.scale; })) coded.erase("SCALE");
  for (auto& [name, values] : coded)
    attributes[name] = streams.add(values.format, values.bytes, std::move(values.accessor));
  return moved;
}

} // namespace packtrace
