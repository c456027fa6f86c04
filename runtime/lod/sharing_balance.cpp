#include "runtime/lod/sharing_balance.h"

#include <algorithm>
#include <numeric>

namespace packtrace {
namespace {

constexpr uint32_t kNone = ~0u;
constexpr size_t kTries = 16; // numbers of own cuts tried beyond those that the limit asks for

void leave_out_steps(std::span<const LodStep> steps, double limit, SharingBalance& balance) {
  std::vector<uint32_t>& users = balance.users;
  balance.instead.resize(steps.size());
  std::iota(balance.instead.begin(), balance.instead.end(), 0u);
  const auto built = static_cast<uint32_t>(steps.size()) - 1;
  balance.builds = static_cast<size_t>(std::count_if(users.begin(), users.end() - 1, [](uint32_t u) { return u > 0; }));
  for (;;) {
    uint64_t least = ~uint64_t{0};
    uint32_t finer = kNone, left_out = kNone, taken = kNone;
    for (uint32_t step = 0; step < built; ++step) {
      if (users[step] == 0) continue;
      if (finer != kNone) {
        const uint64_t cost = users[step] * (steps[finer].triangles - steps[step].triangles);
        if (cost < least) least = cost, left_out = step, taken = finer;
      }
      finer = step;
    }
    if (left_out == kNone || static_cast<double>(balance.traced + least) > limit) break;
    users[taken] += users[left_out];
    users[left_out] = 0;
    balance.instead[left_out] = taken;
    balance.traced += least;
    --balance.builds;
  }
  // Finer ones first: where they lead is known.
  for (uint32_t step = 0; step < built; ++step) balance.instead[step] = balance.instead[balance.instead[step]];
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
      leave_out_steps(steps, limit, tried);
      if (!any || own + tried.builds < best.own_cuts + best.builds) best = std::move(tried);
      any = true;
    }
    if (own >= end || (any && own + 1 >= best.own_cuts + best.builds)) return best;
    now.traced -= savings[own].triangles;
    --now.users[savings[own].step];
  }
}

} // namespace packtrace
