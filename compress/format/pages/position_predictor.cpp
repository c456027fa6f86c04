#include "compress/format/pages/position_predictor.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "compress/format/pages/fixed_log.h"

namespace packtrace {
namespace {

/// 2^(x / 1024), linear between powers of two; the inverse of log2_fixed().
double exp2_linear(int32_t x) {
  return std::bit_cast<double>(static_cast<uint64_t>(std::clamp(x + 1023 * kLogOne, kLogOne, 2046 * kLogOne)) << 42);
}

/// Rounds to the nearest integer, halves up. Returns 0 from 2^62 on.
int64_t round_steps(double x) {
  if (!(std::abs(x) < 0x1p62)) return 0;
  const double shifted = x + 0.5;
  const auto whole = static_cast<int64_t>(shifted);
  return whole - (static_cast<double>(whole) > shifted ? 1 : 0);
}

/// Level of an expected square error, 0..39.
uint32_t level(int32_t log) { return static_cast<uint32_t>(std::clamp((log >> 10) + 4, 0, 39)); }

/// Bit width of a length in steps, at most `most`.
uint32_t width_of(double length, uint32_t most) {
  return std::min(static_cast<uint32_t>(std::bit_width(static_cast<uint64_t>(std::min(length, 0x1p40)))), most);
}

uint64_t bits_of(int64_t value) { return static_cast<uint64_t>(value < 0 ? ~value : value); }

// Limits between classes of the angle at o, as the square of its cosine with its sign.
constexpr std::array<double, 6> kAcrossLimits{-0.09, -0.0025, 0.0025, 0.09, 0.36, 0.64};
constexpr std::array<double, 6> kBetweenLimits{-0.64, -0.36, -0.16, -0.04, 0.01, 0.25};

/// Per feature, how much its initial terms grow from one value to the next.
constexpr std::array<int32_t, 7> kFirstSlopes{0, 100, 40, 20, 0, 0, 0};

} // namespace

void PositionPredictor::begin() {
  last_ = {};
  last_span_ = DVec3(0x1p18);
  errors_.fill(-3 * kLogOne);
  counts_.fill(0);
  for (size_t f = 0; f < kFeatures; ++f)
    for (size_t i = 0; i < kTerms; ++i) terms_[f][i] = static_cast<int32_t>(i) * kFirstSlopes[f];
}

void PositionPredictor::find_corners(const std::vector<PagePoint>& points, const PageTriangles& triangles,
                                     const PointOrder& order, uint32_t point) {
  known_count_ = 0;
  std::array<uint32_t, 3> sum{};
  const uint32_t corners = order.corner_count(point);
  for (uint32_t i = 0; i < corners && known_count_ < kMaxCorners; ++i) {
    const PointOrder::Corner corner = order.corner(point, i);
    if (!corner.both) continue;
    KnownCorner& known = known_[known_count_];
    known.p = triangles.points[PageTriangles::next(corner.corner)];
    known.q = triangles.points[PageTriangles::previous(corner.corner)];
    const PagePoint &p = points[known.p], &q = points[known.q];
    if (known_count_++ == 0) origin_ = p.position;
    for (size_t axis = 0; axis < 3; ++axis) sum[axis] += uint32_t{p.error_bits[axis]} + q.error_bits[axis];
    known.to_p = steps_between(origin_, p.position), known.to_q = steps_between(origin_, q.position);
    if (!corner.across) continue;
    const PagePoint& o = points[triangles.points[triangles.across[corner.corner]]];
    add_guess(known.to_p, known.to_q, steps_between(origin_, o.position), false);
  }
  if (known_count_ == 0) return;
  for (size_t axis = 0; axis < 3; ++axis) near_errors_[axis] = sum[axis] / known_count_;
}

void PositionPredictor::add_guesses_between_edges() {
  for (size_t i = 0; i < known_count_; ++i)
    for (size_t j = i + 1; j < known_count_; ++j) {
      const KnownCorner &a = known_[i], &b = known_[j];
      if (a.q == b.p && a.p != b.q)
        add_guess(a.to_p, b.to_q, a.to_q, true);
      else if (b.q == a.p && a.q != b.p)
        add_guess(b.to_p, a.to_q, a.to_p, true);
    }
}

void PositionPredictor::add_guess(const DVec3& p, const DVec3& q, const DVec3& o, bool between_edges) {
  if (guess_count_ == kMaxGuesses) return;
  const DVec3 u = p - o, v = q - o, w = q - p;
  for (int axis = 0; axis < 3; ++axis)
    span_[axis] = std::max(std::max(span_[axis], std::abs(u[axis])), std::max(std::abs(v[axis]), std::abs(w[axis])));
  const double uu = glm::dot(u, u), vv = glm::dot(v, v), uv = glm::dot(u, v);
  const double cosine = uv * std::abs(uv), scale = uu * vv;
  uint32_t angle = 0;
  for (const double limit : between_edges ? kBetweenLimits : kAcrossLimits) angle += cosine >= limit * scale ? 1 : 0;
  guesses_[guess_count_++] = {p + v, log2_fixed(uu + vv + 1.0), (between_edges ? kAngles : 0) + angle};
}

void PositionPredictor::classify_by_agreement() {
  std::array<double, kMaxGuesses> nearest;
  nearest.fill(0x1p1000);
  for (size_t i = 0; i < guess_count_; ++i)
    for (size_t j = i + 1; j < guess_count_; ++j) {
      const DVec3 apart = guesses_[i].place - guesses_[j].place;
      const double square = glm::dot(apart, apart);
      nearest[i] = std::min(nearest[i], square), nearest[j] = std::min(nearest[j], square);
    }
  for (size_t i = 0; i < guess_count_; ++i) {
    const int32_t apart = log2_fixed(nearest[i] + 0.5) - guesses_[i].log_size;
    const int32_t agreement =
        std::clamp((apart + 14 * kLogOne) / (3 * kLogOne), 0, static_cast<int32_t>(kAgreements) - 2);
    guesses_[i].cls += 2 * kAngles * (1 + static_cast<uint32_t>(agreement));
  }
}

void PositionPredictor::mix_guesses() {
  if (guess_count_ > 1) classify_by_agreement();
  double weights = 0.0;
  DVec3 sum(0.0);
  least_expected_ = expected(guesses_[0]);
  for (size_t i = 0; i < guess_count_; ++i) {
    const int32_t error = expected(guesses_[i]);
    least_expected_ = std::min(least_expected_, error);
    const double weight = exp2_linear(-((3 * error) >> 1)); // the inverse cube of the expected distance
    weights += weight;
    sum += guesses_[i].place * weight;
  }
  set_prediction(sum / weights);
  const double squares = glm::dot(span_, span_);
  least_share_ = squares * 0x1p-6;
  log_square_span_ = log2_fixed(squares + 1.0);
  for (size_t i = 0; i < guess_count_; ++i)
    for (int axis = 0; axis < 3; ++axis)
      spread_[axis] = std::max(spread_[axis], std::abs(guesses_[i].place[axis] - place_[axis]));
}

void PositionPredictor::predict_without_guess(const std::vector<PagePoint>& points, const PageTriangles& triangles,
                                              const PointOrder& order, uint32_t point) {
  DVec3 place(0.0);
  if (known_count_ > 0) { // the mean of the points beside it
    for (size_t i = 0; i < known_count_; ++i) {
      const auto& [p, q, to_p, to_q] = known_[i];
      place += to_p + to_q;
      for (int axis = 0; axis < 3; ++axis) span_[axis] = std::max(span_[axis], std::abs(to_q[axis] - to_p[axis]));
    }
    place = place / (2.0 * known_count_);
  } else { // a neighbour, if one is known
    origin_ = last_;
    span_ = last_span_;
    for (uint32_t i = 0; i < order.corner_count(point); ++i) {
      const uint32_t corner = order.corner(point, i).corner;
      const uint32_t p = triangles.points[PageTriangles::next(corner)],
                     q = triangles.points[PageTriangles::previous(corner)];
      if (order.known(p) || order.known(q)) origin_ = points[order.known(p) ? p : q].position;
    }
  }
  set_prediction(place);
}

void PositionPredictor::set_prediction(const DVec3& place) {
  place_ = place;
  for (size_t axis = 0; axis < 3; ++axis)
    prediction_[axis] = static_cast<int64_t>(static_cast<uint64_t>(origin_[axis]) +
                                             static_cast<uint64_t>(round_steps(place[static_cast<int>(axis)])));
}

void PositionPredictor::predict(const std::vector<PagePoint>& points, const PageTriangles& triangles,
                                const PointOrder& order, uint32_t point) {
  guess_count_ = 0;
  span_ = DVec3(0.0), spread_ = DVec3(0.0);
  find_corners(points, triangles, order, point);
  add_guesses_between_edges();
  if (guess_count_ > 0)
    mix_guesses();
  else
    predict_without_guess(points, triangles, order, point);
  if (known_count_ > 0) last_span_ = span_;
}

PositionPredictor::Models PositionPredictor::models(size_t axis) {
  axis_ = axis;
  const double span = span_[static_cast<int>(axis)];
  if (axis == 0) surprises_ = {}, span_surprise_ = 0;
  span_bits_ = width_of(span, kWidest);
  if (guess_count_ == 0) {
    const uint32_t kind = known_count_ > 0 ? 1 : 0;
    return {context::kPositionAlone + (kind * (kWidest + 1) + span_bits_) * 3 + span_surprise_, 0, false};
  }
  const int32_t share = log2_fixed(span * span + least_share_) - log_square_span_;
  const uint32_t near = near_errors_[axis], along = level(least_expected_ + share);
  const uint32_t spread = guess_count_ > 1 ? width_of(2.0 * spread_[static_cast<int>(axis)], kWidest) : span_bits_;
  features_ = {static_cast<uint32_t>(std::min<size_t>(guess_count_, 3) * 3 + axis),
               spread,
               std::min(near, 31u),
               along,
               level(least_expected_),
               surprises_[0],
               surprises_[1]};
  estimate_ = 0;
  for (size_t f = 0; f < kFeatures; ++f) estimate_ += terms_[f][features_[f]];
  const auto expected =
      static_cast<uint32_t>(std::clamp(estimate_ >> 7, 0, static_cast<int32_t>(context::kWidths) - 1));
  return {context::kPosition + expected, context::kPositionNear + std::min(near, 23u) * 16 + std::min(along / 2, 15u),
          true};
}

void PositionPredictor::learn_error(int64_t error) {
  const auto width = static_cast<uint32_t>(std::bit_width(bits_of(error)));
  error_bits_[axis_] = static_cast<uint8_t>(width);
  if (guess_count_ == 0) {
    span_surprise_ = width == 0 ? 0 : width + 2 < span_bits_ ? 1 : 2;
    return;
  }
  const auto coded = static_cast<int32_t>(error == 0 ? 0 : width + 1); // with the sign
  const int32_t off = coded * 256 - estimate_;
  for (size_t f = 0; f < kFeatures; ++f) terms_[f][features_[f]] += off >> 6;
  surprises_ = {static_cast<uint32_t>(std::clamp(off >> 8, -5, 5) + 6), surprises_[0]};
}

void PositionPredictor::learn_position(const LatticePoint& position) {
  last_ = position;
  const DVec3 place = steps_between(origin_, position);
  for (size_t i = 0; i < guess_count_; ++i) {
    const DVec3 off = guesses_[i].place - place;
    const int32_t error = log2_fixed(glm::dot(off, off) + 0.5) - guesses_[i].log_size;
    int32_t& mean = errors_[guesses_[i].cls];
    uint8_t& count = counts_[guesses_[i].cls];
    mean += (error - mean) >> std::min(static_cast<int>(std::bit_width(count + 1u)), 5);
    count = static_cast<uint8_t>(std::min(count + 1, 15));
  }
}

} // namespace packtrace
