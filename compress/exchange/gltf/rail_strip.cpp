#include "compress/exchange/gltf/rail_strip.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <tuple>

namespace packtrace {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// Half-edge h of triangle h / 3 leads from corner h to next(h).
uint32_t next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
uint32_t previous(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/// Half-edge in the opposite direction, by half-edge; kNone at borders. Of edges with more triangles, the k-th
/// half-edge of each direction are a pair.
std::vector<uint32_t> twins(std::span<const uint32_t> corners) {
  struct Edge {
    uint64_t ends;
    uint32_t half_edge;
    bool backward;
  };
  std::vector<Edge> edges(corners.size());
  for (uint32_t h = 0; h < corners.size(); ++h) {
    const uint64_t a = corners[h], b = corners[next(h)];
    edges[h] = {std::min(a, b) << 32 | std::max(a, b), h, a > b};
  }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.ends, e.backward, e.half_edge); });
  std::vector<uint32_t> twin(corners.size(), kNone);
  for (size_t begin = 0; begin < edges.size();) {
    size_t middle = begin, end = begin;
    while (end < edges.size() && edges[end].ends == edges[begin].ends) middle += !edges[end++].backward;
    for (size_t i = begin, k = middle; i < middle && k < end; ++i, ++k) {
      twin[edges[i].half_edge] = edges[k].half_edge;
      twin[edges[k].half_edge] = edges[i].half_edge;
    }
    begin = end;
  }
  return twin;
}

class Strip {
public:
  Strip(std::span<const uint32_t> corners, size_t vertices)
      : corners_(corners), twin_(twins(corners)), done_(corners.size() / 3), number_(vertices, kNone) {
    result_.order.reserve(vertices);
  }

  RailStrip run() {
    for (uint32_t seed = 0; seed < done_.size(); ++seed) {
      if (done_[seed]) continue;
      open_.push_back(3 * seed);
      while (!open_.empty()) {
        const uint32_t h = open_.back();
        open_.pop_back();
        if (!done_[h / 3]) follow(start(h));
      }
    }
    return std::move(result_);
  }

private:
  /// Bytes that a difference of indices takes beyond two bits.
  static int cost(int64_t difference) {
    const int64_t size = std::abs(difference);
    return size <= 1 ? 0 : size <= 127 ? 1 : 2;
  }
  /// Number of a vertex, or the one that it would get.
  int64_t number(uint32_t vertex, int64_t unused) const {
    return number_[vertex] != kNone ? int64_t{number_[vertex]} : unused;
  }
  uint32_t use(uint32_t vertex) {
    if (number_[vertex] == kNone) {
      number_[vertex] = static_cast<uint32_t>(result_.order.size());
      result_.order.push_back(vertex);
    }
    return number_[vertex];
  }
  bool is_open(uint32_t half_edge) const { return half_edge != kNone && !done_[half_edge / 3]; }

  /// The half-edge of h's triangle from which a strip begins at least cost; goes there.
  uint32_t start(uint32_t h) {
    uint32_t best = h;
    int least = std::numeric_limits<int>::max();
    for (const uint32_t first : {h, next(h), previous(h)}) {
      const int price = start_cost(first);
      if (price < least) least = price, best = first;
    }
    const uint32_t left = use(corners_[best]), right = use(corners_[next(best)]);
    std::vector<std::array<uint32_t, 2>>& elements = result_.elements;
    if (!elements.empty()) {
      const uint32_t last = elements.back()[1];
      if (left != last) elements.push_back({last, left});
    }
    elements.push_back({left, right});
    moved_left_ = false;
    return best;
  }

  int start_cost(uint32_t h) const {
    int64_t unused = static_cast<int64_t>(result_.order.size());
    const auto take = [&](uint32_t vertex) {
      const int64_t n = number(vertex, unused);
      unused += n == unused;
      return n;
    };
    const int64_t left = take(corners_[h]), right = take(corners_[next(h)]), x = take(corners_[previous(h)]);
    const bool goes_left = is_open(twin_[next(h)]), goes_right = is_open(twin_[previous(h)]);
    constexpr int kEnds = 4;
    const int price = std::min(cost(x - left) + (goes_left ? 0 : kEnds), cost(x - right) + (goes_right ? 0 : kEnds));
    if (result_.elements.empty()) return price;
    const auto [l, r] = result_.elements.back();
    if (left != r) return price + cost(int64_t{r} - l) + 2 * cost(left - int64_t{r}) + cost(right - left);
    return price + cost(int64_t{r} - l) + cost(right - int64_t{r});
  }

  /// Adds triangles from half-edge h on, as far as the strip leads.
  void follow(uint32_t h) {
    while (h != kNone) {
      done_[h / 3] = true;
      const uint32_t left_way = twin_[next(h)], right_way = twin_[previous(h)];
      const bool goes_left = is_open(left_way), goes_right = is_open(right_way);
      const uint32_t x = use(corners_[previous(h)]);
      const auto [l, r] = result_.elements.back();
      constexpr int kEnds = 8;
      const int left_cost = 2 * cost(int64_t{x} - l) + (goes_left ? 0 : kEnds) + moved_left_;
      const int right_cost = 2 * cost(int64_t{x} - r) + (goes_right ? 0 : kEnds);
      const bool to_left = left_cost < right_cost;
      if (goes_left && goes_right) open_.push_back(to_left ? right_way : left_way);
      if (to_left) {
        result_.elements.push_back({x, r});
        moved_left_ = true;
        h = goes_left ? left_way : kNone;
      } else {
        if (moved_left_)
          result_.elements.back()[1] = x;
        else
          result_.elements.push_back({l, x});
        moved_left_ = false;
        h = goes_right ? right_way : kNone;
      }
    }
  }

  std::span<const uint32_t> corners_;
  std::vector<uint32_t> twin_;
  std::vector<bool> done_;       ///< by triangle
  std::vector<uint32_t> number_; ///< by vertex
  std::vector<uint32_t> open_;   ///< half-edges of triangles beside the strip
  bool moved_left_ = false;      ///< whether the last element's right index may still change
  RailStrip result_;
};

} // namespace

RailStrip rail_strip(std::span<const uint32_t> triangles, size_t vertices) { return Strip(triangles, vertices).run(); }

} // namespace packtrace
