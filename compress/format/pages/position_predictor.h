#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/format/pages/page_border.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/point_order.h"

namespace packtrace {

/// Predicts the positions of new points from the known points around them, and how far off the prediction will be.
///
/// Around a point lie parallelograms: over the edge that faces it, and over two edges that meet beside it. Each gives a
/// guess. The prediction is their mean, weighted by the recent errors of guesses of the same class: of the same kind,
/// with a similar angle, and as close to the nearest other guess. So classes that were right more often count more:
/// inside a quad the guess over its diagonal, at a crease the guesses that agree. The width of each coordinate's error
/// is estimated as a sum of learned terms, one per feature of the surroundings.
///
/// The results are the same on every machine: only +, -, x and / of doubles and integer arithmetic are used.
/// Sources: Touma and Gotsman, "Triangle mesh compression" (1998); Cohen-Or, Cohen and Irony, "Multi-way geometry
/// encoding" (2002).
class PositionPredictor {
public:
  /// Models that code an error; there are two of them, whose mean is used, or only `first`.
  struct Models {
    uint32_t first, second;
    bool mixed;
  };

  /// Forgets what was learned from earlier pages.
  void begin();

  /// Predicts a new point from those that the order knows.
  void predict(const std::vector<PagePoint>& points, const PageTriangles& triangles, const PointOrder& order,
               uint32_t point);

  /// The predicted coordinate.
  int64_t coordinate(size_t axis) const { return prediction_[axis]; }

  /// Selects the models of the error along an axis. Call for x, y and z in turn, each followed by learn_error().
  Models models(size_t axis);

  /// Takes the error along the axis of the last models().
  void learn_error(int64_t error);

  /// Takes the position after all three errors.
  void learn_position(const LatticePoint& position);

  /// Bit widths of the errors that learn_error() took.
  const std::array<uint8_t, 3>& error_bits() const { return error_bits_; }

private:
  static constexpr size_t kMaxCorners = 8, kMaxGuesses = 12;
  static constexpr uint32_t kAngles = 7, kAgreements = 6, kClasses = kAgreements * 2 * kAngles;
  static constexpr uint32_t kWidest = 19;

  /// A guess at p + q - o.
  struct Guess {
    DVec3 place;      ///< relative to the origin
    int32_t log_size; ///< log of the square of its size, see log2_fixed()
    uint32_t cls;     ///< class of guesses with common errors
  };

  /// A corner of the point; the other two points of its triangle are known.
  struct KnownCorner {
    uint32_t p, q;    ///< the next and the previous point
    DVec3 to_p, to_q; ///< from the origin
  };

  void find_corners(const std::vector<PagePoint>& points, const PageTriangles& triangles, const PointOrder& order,
                    uint32_t point);
  void add_guess(const DVec3& p, const DVec3& q, const DVec3& o, bool between_edges);
  void add_guesses_between_edges();
  void mix_guesses();
  void classify_by_agreement();
  void predict_without_guess(const std::vector<PagePoint>& points, const PageTriangles& triangles,
                             const PointOrder& order, uint32_t point);
  void set_prediction(const DVec3& place);
  int32_t expected(const Guess& g) const { return g.log_size + errors_[g.cls]; }

  LatticePoint origin_{}, prediction_{}, last_{};
  DVec3 place_{0.0}, span_{0.0}, last_span_{0.0}, spread_{0.0};
  std::array<KnownCorner, kMaxCorners> known_{};
  uint32_t known_count_ = 0;
  std::array<uint32_t, 3> near_errors_{}; ///< mean width of the errors at p and q of known corners, in halves
  std::array<Guess, kMaxGuesses> guesses_{};
  size_t guess_count_ = 0;
  int32_t least_expected_ = 0;
  double least_share_ = 0.0;    ///< of an axis in the square of the span
  int32_t log_square_span_ = 0; ///< see log2_fixed()

  std::array<int32_t, kClasses> errors_{}; ///< mean of log(square error / size), see log2_fixed()
  std::array<uint8_t, kClasses> counts_{};

  // Estimate of an error's width, in 256ths: the sum of one term per feature.
  static constexpr size_t kFeatures = 7, kTerms = 40;
  std::array<std::array<int32_t, kTerms>, kFeatures> terms_{};
  std::array<uint32_t, kFeatures> features_{};
  int32_t estimate_ = 0;
  size_t axis_ = 0;
  std::array<uint32_t, 2> surprises_{}; ///< of the last two axes, 0 before the first
  uint32_t span_bits_ = 0, span_surprise_ = 0;
  std::array<uint8_t, 3> error_bits_{};
};

} // namespace packtrace
