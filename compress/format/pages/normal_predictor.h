#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "compress/format/cluster/normal_codec.h"
#include "compress/format/pages/fixed_log.h"
#include "compress/format/pages/page_normals.h"

namespace packtrace {

/// Data about a vertex that are decoded before its normal. All normals have unit length.
struct NormalSurroundings {
  DVec3 face_sum{0.0};               ///< sum of the cross products of the vertex's triangles, in lattice steps
  uint32_t triangle_count = 0;       ///< triangles in face_sum
  uint32_t neighbour_count = 0;      ///< 0..2 vertices of the triangle that introduced the vertex
  std::array<DVec3, 2> neighbours{}; ///< their normals
  std::array<DVec3, 2> edges{};      ///< from them to the vertex, in lattice steps
  bool has_opposite = false;         ///< whether the triangle across the edge of two neighbours is known
  DVec3 opposite{0.0};               ///< the normal of its third corner
};

/// Predicts normals as a mix of three guesses. Each is good where another one fails: the face guess at fine positions,
/// the surface guess where rounding tilts the faces, the chord guess at borders of clusters, where faces are missing.
/// The weights follow the recent errors of the guesses at similar vertices. The results are the same on every machine:
/// only +, -, x, / and square root of doubles and integer arithmetic are used.
class NormalPredictor {
public:
  /// Forgets all errors.
  void begin() { memory_.fill({}); }

  /// Returns the canonical fields near the next normal.
  NormalFields predict(NormalEncoding encoding, const NormalSurroundings& s) {
    steps_ = 0.5 * format_of(encoding).y_codes;
    guesses_[0] = unit(s.face_sum);
    guesses_[1] = surface_guess(s);
    guesses_[2] = chord_guess(s, guesses_[1]);
    similar_ = &memory_[similar_vertices(s)];
    mix_ = DVec3(0.0);
    for (size_t i = 0; i < kGuesses; ++i) mix_ += guesses_[i] * weight(similar_->errors[i]);
    mix_ = unit(mix_);
    return predict_normal_fields(encoding, mix_);
  }

  /// Size class of the expected error, 0..15: about 2 + its binary logarithm in steps of the encoding.
  uint32_t expected_error() const { return static_cast<uint32_t>(std::clamp((similar_->mixed >> 11) - 2, 0, 15)); }

  /// Takes the actual normal after predict(). Unit length.
  void learn(DVec3 normal) {
    const uint32_t shift = std::min(static_cast<uint32_t>(std::bit_width(similar_->count + 1)), 4u);
    const auto update = [&](int32_t& mean, DVec3 guess) { mean += (log_error(normal, guess) - mean) >> shift; };
    for (size_t i = 0; i < kGuesses; ++i) update(similar_->errors[i], guesses_[i]);
    update(similar_->mixed, mix_);
    similar_->count += similar_->count < 7 ? 1 : 0;
  }

private:
  static constexpr size_t kGuesses = 3;
  static constexpr int32_t kFirstError = 12 << 10;
  static constexpr uint32_t kFans = 4, kAgreements = 8;

  /// Mean errors at similar vertices, as log_error() gives them.
  struct Errors {
    std::array<int32_t, kGuesses> errors{kFirstError, kFirstError, kFirstError};
    int32_t mixed = kFirstError;
    uint32_t count = 0; ///< vertices learned, at most 7
  };

  static DVec3 unit(DVec3 v) {
    const double square = glm::dot(v, v);
    return square > 0.0 ? v * (1.0 / std::sqrt(square)) : v;
  }

  /// Continues the normals linearly across the edge of the two neighbours.
  static DVec3 surface_guess(const NormalSurroundings& s) {
    if (s.neighbour_count == 0) return unit(s.face_sum);
    if (s.neighbour_count == 1) return s.neighbours[0];
    const DVec3 sum = s.neighbours[0] + s.neighbours[1];
    return unit(s.has_opposite ? sum - s.opposite : sum);
  }

  /// Turns a guess until its projection on each edge is the negative of the neighbour's, as on a sphere: there the sum
  /// of two normals is perpendicular to the chord between them. Two rounds of projections.
  static DVec3 chord_guess(const NormalSurroundings& s, DVec3 guess) {
    std::array<double, 2> scale{};
    for (uint32_t i = 0; i < s.neighbour_count; ++i) {
      const double square = glm::dot(s.edges[i], s.edges[i]);
      scale[i] = square > 0.0 ? 1.0 / square : 0.0;
    }
    for (int round = 0; round < 2; ++round)
      for (uint32_t i = s.neighbour_count; i-- > 0;)
        guess -= s.edges[i] * (glm::dot(guess + s.neighbours[i], s.edges[i]) * scale[i]);
    return unit(guess);
  }

  /// Vertices are similar if they have the same kinds of neighbours and their guesses agree equally well.
  uint32_t similar_vertices(const NormalSurroundings& s) const {
    const DVec3 difference = guesses_[0] - guesses_[1];
    const auto apart = static_cast<uint32_t>(glm::dot(difference, difference) * 4096.0); // at most 4 * 4096
    const uint32_t agreement = std::min((static_cast<uint32_t>(std::bit_width(apart)) + 1) / 2, kAgreements - 1);
    const uint32_t fan = std::clamp(s.triangle_count, 1u, kFans) - 1;
    const uint32_t known = s.neighbour_count < 2 ? 0u : s.has_opposite ? 2u : 1u;
    return (agreement * 3 + known) * kFans + fan;
  }

  /// Binary logarithm of 1 + (16 x error in steps)^2 times 1024, linear between powers of two.
  int32_t log_error(DVec3 normal, DVec3 guess) const {
    const DVec3 error = (normal - guess) * steps_;
    const double square = glm::dot(error, error) * 256.0 + 1.0;
    return log2_fixed(square);
  }

  /// About 2^(-2 e / 1024), thus the inverse fourth power of the error: near a crease the better guess wins.
  static double weight(int32_t error) {
    return std::bit_cast<double>((uint64_t{1023} << 52) - (static_cast<uint64_t>(error) << 43));
  }

  std::array<Errors, kAgreements * 3 * kFans> memory_{};
  Errors* similar_ = &memory_[0];
  double steps_ = 1.0; ///< steps of the encoding per unit of length
  std::array<DVec3, kGuesses> guesses_{};
  DVec3 mix_{0.0};
};

} // namespace packtrace
