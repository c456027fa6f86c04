#include "runtime/lod/sharing_balance.h"

#include <algorithm>
#include <numeric>

namespace packtrace {
namespace {

constexpr size_t kTries = 8; // numbers of own cuts tried beyond the smallest that meets the limit

/// Chooses which of the used steps are built. Steps are partitioned into segments whose users all take the finest step
/// of the segment. Dynamic programming over segment ends finds the fewest triangles for one segment, two, ... until the
/// limit is met.
class StepChooser {
public:
  StepChooser(std::span<const LodStep> steps, std::span<const uint32_t> users) : steps_(steps) {
    for (uint32_t step = 0; step + 1 < steps.size(); ++step) { // the last step needs no build
      if (users[step] == 0) continue;
      used_.push_back(step);
      count_.push_back(count_.back() + users[step]);
      triangles_.push_back(triangles_.back() + users[step] * steps[step].triangles);
    }
  }

  /// Returns the first steps of the segments, ascending.
  /// @param room triangles that may be traced in addition
  /// @param spent set to the triangles that are traced in addition
  std::vector<uint32_t> choose(uint64_t room, uint64_t& spent) {
    const size_t count = used_.size();
    if (count == 0) return {};
    std::vector<uint64_t> extra(count + 1), before(count + 1); // per number of steps covered
    for (size_t end = 1; end <= count; ++end) extra[end] = cost(0, end);
    std::vector<std::vector<uint32_t>> first{std::vector<uint32_t>(count + 1)}; // of the last segment
    while (extra[count] > room) {
      const size_t segments = first.size() + 1;
      before.swap(extra);
      first.emplace_back(count + 1);
      for (size_t end = segments; end <= count; ++end) {
        extra[end] = ~uint64_t{0};
        for (size_t begin = segments - 1; begin < end; ++begin)
          if (const uint64_t all = before[begin] + cost(begin, end); all < extra[end])
            extra[end] = all, first.back()[end] = static_cast<uint32_t>(begin);
      }
    }
    spent = extra[count];
    std::vector<uint32_t> built(first.size());
    for (size_t segment = first.size(), end = count; segment-- > 0; end = first[segment][end])
      built[segment] = used_[first[segment][end]];
    return built;
  }

private:
  /// Additional triangles if the users of used steps [begin, end) take the first of them.
  uint64_t cost(size_t begin, size_t end) const {
    return steps_[used_[begin]].triangles * (count_[end] - count_[begin]) - (triangles_[end] - triangles_[begin]);
  }

  std::span<const LodStep> steps_;
  std::vector<uint32_t> used_;
  std::vector<uint64_t> count_{0}, triangles_{0}; ///< prefix sums
};

/// Chooses the steps to build and moves the users of all others to them.
void choose_built_steps(std::span<const LodStep> steps, double limit, SharingBalance& balance) {
  balance.instead.resize(steps.size());
  std::iota(balance.instead.begin(), balance.instead.end(), 0u);
  uint64_t spent = 0, room = 0;
  if (const auto traced = static_cast<double>(balance.traced); limit > traced)
    room = static_cast<uint64_t>(std::min(limit - traced, 0x1p62));
  const std::vector<uint32_t> built = StepChooser(steps, balance.users).choose(room, spent);
  balance.builds = built.size();
  balance.traced += spent;
  size_t segment = 0;
  for (uint32_t step = 0; step + 1 < steps.size(); ++step) {
    if (balance.users[step] == 0) continue;
    if (segment + 1 < built.size() && built[segment + 1] == step) ++segment;
    if (built[segment] == step) continue;
    balance.instead[step] = built[segment];
    balance.users[built[segment]] += balance.users[step];
    balance.users[step] = 0;
  }
}

} // namespace

SharingBalance balance_builds(std::span<const LodStep> steps, std::span<const uint32_t> users, uint64_t traced,
                              double limit, std::span<const OwnCutSaving> savings) {
  SharingBalance now{0, 0, traced, {users.begin(), users.end()}, {}}, best;
  bool any = false;
  for (size_t end = savings.size();; ++now.own_cuts) {
    const size_t own = now.own_cuts;
    if (static_cast<double>(now.traced) <= limit || own == savings.size()) {
      if (!any) end = std::min(end, own + kTries);
      SharingBalance tried = now;
      choose_built_steps(steps, limit, tried);
      if (!any || own + tried.builds < best.own_cuts + best.builds) best = std::move(tried);
      any = true;
    }
    if (own >= end || (any && own + 1 >= best.own_cuts + best.builds)) return best;
    now.traced -= savings[own].triangles;
    --now.users[savings[own].step];
  }
}

} // namespace packtrace
