#include "pbrt_import/base/memory_budget.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <utility>

#include <sys/resource.h>
#include <unistd.h>

namespace packtrace {
namespace {

namespace fs = std::filesystem;

uint64_t add_capped(uint64_t a, uint64_t b) { return b > UINT64_MAX - a ? UINT64_MAX : a + b; }

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The number in a file; UINT64_MAX if the file holds no number (such as "max") or does not exist.
uint64_t number_in(const fs::path& file) {
  const std::string text = text_of(file);
  uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() ? value : UINT64_MAX;
}

/// Smallest limit of a control group and its ancestors.
uint64_t least_limit(const fs::path& root, std::string_view group, const char* file) {
  uint64_t least = number_in(root / file);
  fs::path path = root;
  for (const fs::path& part : fs::path(group).relative_path()) {
    path /= part;
    least = std::min(least, number_in(path / file));
  }
  return least;
}

uint64_t resource_limit(__rlimit_resource resource) {
  struct rlimit limit{};
  return ::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY ? limit.rlim_cur : UINT64_MAX;
}

} // namespace

MemoryBudget::MemoryBudget(uint64_t bytes) : state_(std::make_shared<State>()) { state_->limit = bytes; }

uint64_t MemoryBudget::default_bytes() {
  static const uint64_t kHalf = machine_memory() / 2;
  return kHalf;
}

uint64_t MemoryBudget::left() const { return limit() - std::min(used(), limit()); }

bool MemoryBudget::take(uint64_t bytes) const {
  uint64_t used = state_->used.load(std::memory_order_relaxed);
  do {
    if (bytes > state_->limit - used) return false; // used never exceeds the limit
  } while (!state_->used.compare_exchange_weak(used, used + bytes, std::memory_order_relaxed));
  return true;
}

MemoryReservation::MemoryReservation(MemoryReservation&& other) noexcept
    : budget_(std::move(other.budget_)), bytes_(std::exchange(other.bytes_, 0)) {
  other.budget_ = budget_;
}

MemoryReservation& MemoryReservation::operator=(MemoryReservation&& other) noexcept {
  if (this == &other) return *this;
  release();
  budget_ = other.budget_;
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

void MemoryReservation::resize(uint64_t bytes, std::string_view what) {
  if (budget_ && bytes > bytes_ && !budget_->take(bytes - bytes_))
    throw MemoryError(std::string(what) + " needs " + memory_text(bytes) + " of memory, of " +
                      memory_text(add_capped(budget_->left(), bytes_)) + " left; --max-memory raises it");
  if (budget_ && bytes < bytes_) budget_->state_->used.fetch_sub(bytes_ - bytes, std::memory_order_relaxed);
  bytes_ = bytes;
}

void MemoryReservation::merge(MemoryReservation&& other) noexcept {
  if (!budget_) budget_ = other.budget_;
  bytes_ += std::exchange(other.bytes_, 0);
}

void MemoryReservation::release() noexcept {
  if (budget_) budget_->state_->used.fetch_sub(bytes_, std::memory_order_relaxed);
  bytes_ = 0;
}

uint64_t control_group_memory(std::string_view membership, const fs::path& root) {
  uint64_t least = UINT64_MAX;
  for (size_t begin = 0; begin < membership.size();) {
    const size_t end = std::min(membership.find('\n', begin), membership.size());
    const std::string_view line = membership.substr(begin, end - begin); // "number:controllers:group"
    begin = end + 1;
    const size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == line.npos || second == line.npos) continue;
    const std::string controllers = "," + std::string(line.substr(first + 1, second - first - 1)) + ",";
    const std::string_view group = line.substr(second + 1);
    if (controllers == ",,") least = std::min(least, least_limit(root, group, "memory.max"));
    if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, least_limit(root / "memory", group, "memory.limit_in_bytes"));
  }
  return least;
}

uint64_t machine_memory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), page_bytes = ::sysconf(_SC_PAGESIZE);
  const uint64_t physical =
      pages > 0 && page_bytes > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page_bytes) : UINT64_MAX;
  return std::min({physical, control_group_memory(text_of("/proc/self/cgroup"), "/sys/fs/cgroup"),
                   resource_limit(RLIMIT_AS), resource_limit(RLIMIT_DATA)});
}

uint64_t parse_memory_size(std::string_view text, uint64_t all) {
  const auto fail = [&]() -> uint64_t {
    throw Error(ErrorKind::kUsage, "a memory size is a number of bytes, with K, M, G or T, or a percentage of the "
                                   "machine's memory, such as 512M, 8G or 50%; found " +
                                       std::string(text));
  };
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc() || !std::isfinite(value)) return fail(); // from_chars reads "inf" and "nan"
  const std::string_view unit(end, text.data() + text.size());
  if (unit == "%") {
    value *= static_cast<double>(all) / 100.0;
  } else {
    constexpr std::string_view kUnits = "KMGT";
    std::string_view rest = unit;
    if (!rest.empty()) {
      const size_t power = kUnits.find(static_cast<char>(rest[0] & ~0x20));
      if (power != kUnits.npos) {
        value *= std::exp2(10.0 * static_cast<double>(power + 1));
        rest.remove_prefix(1);
        if (rest.starts_with("i")) rest.remove_prefix(1);
      }
      if (rest == "B") rest.remove_prefix(1);
    }
    if (!rest.empty()) return fail();
  }
  if (!(value >= 1.0)) return fail();
  constexpr double kMax = 0x1p63; // more than any machine has
  return static_cast<uint64_t>(std::min(value, kMax));
}

std::string memory_text(uint64_t bytes) {
  constexpr std::array kUnits{"bytes", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  size_t unit = 0;
  for (; value >= 1024.0 && unit + 1 < kUnits.size(); ++unit) value /= 1024.0;
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), unit > 0 && value < 100.0 ? "%.1f" : "%.0f", value);
  return std::string(digits.data()) + " " + kUnits[unit];
}

} // namespace packtrace
