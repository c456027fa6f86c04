#include "runtime/shade/bsdf.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

/// Factor of Oren and Nayar's model relative to Lambert's.
/// Source: Oren and Nayar, Generalization of Lambert's reflectance model, 1994, the qualitative model.
float oren_nayar(Vec3 o, Vec3 i, float sigma_degrees) {
  const float sigma = sigma_degrees * (kShadePi / 180.0f), s2 = sigma * sigma;
  const float a = 1.0f - s2 / (2.0f * (s2 + 0.33f)), b = 0.45f * s2 / (s2 + 0.09f);
  const float sin_o = std::sqrt(std::max(0.0f, 1.0f - o.z * o.z)), sin_i = std::sqrt(std::max(0.0f, 1.0f - i.z * i.z));
  if (sin_o < 1e-4f || sin_i < 1e-4f) return a;
  const float cos_between = std::max(0.0f, (o.x * i.x + o.y * i.y) / (sin_o * sin_i));
  // The larger angle has the smaller cosine; its sine times the tangent of the other.
  return a + b * cos_between * (i.z > o.z ? sin_o * (sin_i / i.z) : sin_i * (sin_o / o.z));
}

} // namespace

float fresnel_dielectric(float cosine, float eta) {
  const float sin2_far = (1.0f - cosine * cosine) / (eta * eta);
  if (sin2_far >= 1.0f) return 1.0f;
  const float cos_far = std::sqrt(1.0f - sin2_far);
  const float parallel = (eta * cosine - cos_far) / (eta * cosine + cos_far);
  const float perpendicular = (cosine - eta * cos_far) / (cosine + eta * cos_far);
  return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

float fresnel_conductor(float cosine, float eta, float k) {
  const float cos2 = cosine * cosine, sin2 = 1.0f - cos2, eta2 = eta * eta, k2 = k * k;
  const float t0 = eta2 - k2 - sin2;
  const float a2b2 = std::sqrt(t0 * t0 + 4.0f * eta2 * k2);
  const float a = std::sqrt(std::max(0.0f, 0.5f * (a2b2 + t0)));
  const float s1 = a2b2 + cos2, s2 = 2.0f * a * cosine;
  const float perpendicular = s1 + s2 > 0.0f ? (s1 - s2) / (s1 + s2) : 1.0f;
  const float p1 = cos2 * a2b2 + sin2 * sin2, p2 = s2 * sin2;
  const float parallel = p1 + p2 > 0.0f ? perpendicular * (p1 - p2) / (p1 + p2) : perpendicular;
  return std::clamp(0.5f * (perpendicular + parallel), 0.0f, 1.0f);
}

Vec3 refracted(Vec3 outgoing, Vec3 normal, float eta) {
  const float cosine = glm::dot(outgoing, normal);
  const float sin2_far = std::max(0.0f, 1.0f - cosine * cosine) / (eta * eta);
  if (sin2_far >= 1.0f) return Vec3(0.0f);
  return glm::normalize((cosine / eta - std::sqrt(1.0f - sin2_far)) * normal - outgoing / eta);
}

float Ggx::density(Vec3 half) const {
  const float a2 = alpha * alpha, z2 = half.z * half.z;
  const float t = z2 * (a2 - 1.0f) + 1.0f;
  return a2 / (kShadePi * t * t);
}

float Ggx::lambda(Vec3 v) const {
  const float z2 = v.z * v.z, tan2 = std::max(0.0f, 1.0f - z2) / z2;
  return 0.5f * (std::sqrt(1.0f + alpha * alpha * tan2) - 1.0f);
}

Vec3 Ggx::visible_normal(Vec3 o, Vec2 u) const {
  const Vec3 stretched = glm::normalize(Vec3(alpha * o.x, alpha * o.y, o.z));
  const float length2 = stretched.x * stretched.x + stretched.y * stretched.y;
  const Vec3 tangent = length2 > 1e-12f ? Vec3(-stretched.y, stretched.x, 0.0f) / std::sqrt(length2) : Vec3(1, 0, 0);
  const Vec3 bitangent = glm::cross(stretched, tangent);
  const float radius = std::sqrt(u.x), angle = 2.0f * kShadePi * u.y;
  const float x = radius * std::cos(angle), s = 0.5f * (1.0f + stretched.z);
  const float y = (1.0f - s) * std::sqrt(std::max(0.0f, 1.0f - x * x)) + s * radius * std::sin(angle);
  const Vec3 n = x * tangent + y * bitangent + std::sqrt(std::max(0.0f, 1.0f - x * x - y * y)) * stretched;
  return glm::normalize(Vec3(alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)));
}

ShadedSurface::ShadedSurface(const SurfaceShading& material, Vec3 albedo)
    : shading(material), diffuse(albedo * material.diffuse),
      specular(material.bits & kSpecularTimesAlbedo ? material.specular * albedo : material.specular),
      transmission(material.bits & kTransmissionTimesAlbedo ? material.transmission * albedo : material.transmission) {}

Vec3 ShadedSurface::reflectance(float cosine, float eta) const {
  switch (shading.fresnel()) {
  case kFresnelDielectric:
    return specular * fresnel_dielectric(cosine, eta);
  case kFresnelConductor:
    return specular * Vec3(fresnel_conductor(cosine, shading.metal_eta.x, shading.metal_k.x),
                           fresnel_conductor(cosine, shading.metal_eta.y, shading.metal_k.y),
                           fresnel_conductor(cosine, shading.metal_eta.z, shading.metal_k.z));
  case kFresnelSchlick:
    return fresnel_schlick(specular, cosine);
  default:
    return specular;
  }
}

Vec3 ShadedSurface::evaluate_diffuse(Vec3 o, Vec3 i, Vec3 kept) const {
  const float factor = shading.sigma > 0.0f ? oren_nayar(o, i, shading.sigma) : 1.0f;
  return diffuse * kept * (factor * i.z / kShadePi);
}

Vec3 ShadedSurface::evaluate_specular(Vec3 o, Vec3 i, float eta) const {
  if (!reflects() || !rough()) return Vec3(0.0f);
  const Ggx ggx{shading.roughness};
  const Vec3 half = glm::normalize(o + i);
  const float d_g = ggx.density(half) * ggx.shadowing_masking(o, i) / (4.0f * o.z);
  return reflectance(std::clamp(glm::dot(o, half), 0.0f, 1.0f), eta) * d_g;
}

DirectionalAlbedo::DirectionalAlbedo(const SurfaceShading& material) {
  const ShadedSurface surface(material, Vec3(1.0f));
  if (!surface.reflects()) return;
  constexpr uint32_t kSide = 16; // stratified samples per axis
  for (uint32_t n = 0; n < kCount; ++n) {
    const float cosine = std::max(1e-3f, static_cast<float>(n) / (kCount - 1));
    if (!surface.rough()) {
      values_[n] = surface.reflectance(cosine, material.eta);
      continue;
    }
    const Ggx ggx{material.roughness};
    const Vec3 o(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
    Vec3 sum(0.0f);
    for (uint32_t j = 0; j < kSide * kSide; ++j) {
      const uint32_t column = j % kSide, row = j / kSide;
      const Vec2 u((static_cast<float>(column) + 0.5f) / kSide, (static_cast<float>(row) + 0.5f) / kSide);
      const Vec3 half = ggx.visible_normal(o, u), i = reflected(o, half);
      if (i.z <= 0.0f) continue;
      sum += surface.reflectance(std::clamp(glm::dot(o, half), 0.0f, 1.0f), material.eta) *
             (ggx.shadowing_masking(o, i) / ggx.masking(o));
    }
    values_[n] = glm::min(sum / static_cast<float>(kSide * kSide), Vec3(1.0f));
  }
}

Vec3 DirectionalAlbedo::at(float cosine) const {
  const float place = std::clamp(cosine, 0.0f, 1.0f) * (kCount - 1);
  const auto n = std::min(static_cast<uint32_t>(place), kCount - 2);
  return glm::mix(values_[n], values_[n + 1], place - static_cast<float>(n));
}

} // namespace packtrace
