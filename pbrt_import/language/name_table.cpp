#include "pbrt_import/language/name_table.h"

#include <algorithm>
#include <functional>

#include "pbrt_import/language/parameters.h"

namespace packtrace {
namespace {

uint32_t hash_of(std::string_view name) {
  const uint64_t hash = std::hash<std::string_view>{}(name);
  return static_cast<uint32_t>(hash ^ hash >> 32);
}

} // namespace

size_t NameTable::find_slot(std::string_view name, uint32_t hash) const {
  size_t i = hash & (slots_.size() - 1);
  while (slots_[i].number_plus_one != 0 && (slots_[i].hash != hash || names_[slots_[i].number_plus_one - 1] != name))
    i = (i + 1) & (slots_.size() - 1);
  return i;
}

std::optional<uint32_t> NameTable::find(std::string_view name) const {
  if (slots_.empty()) return std::nullopt;
  const Slot& slot = slots_[find_slot(name, hash_of(name))];
  return slot.number_plus_one == 0 ? std::nullopt : std::optional(slot.number_plus_one - 1);
}

uint32_t NameTable::intern(std::string_view name) {
  if (2 * (names_.size() + 1) > slots_.size()) grow();
  const uint32_t hash = hash_of(name);
  Slot& slot = slots_[find_slot(name, hash)];
  if (slot.number_plus_one == 0) {
    names_.push_back(keep(name));
    slot = {hash, static_cast<uint32_t>(names_.size())};
  }
  return slot.number_plus_one - 1;
}

std::string_view NameTable::closest(std::string_view name, const std::function<bool(uint32_t)>& visible) const {
  constexpr uint64_t kMaxCompared = 1'000'000;
  compared_ += names_.size();
  if (compared_ > kMaxCompared) return {};
  std::vector<std::string_view> candidates;
  for (uint32_t number = 0; number < names_.size(); ++number)
    if (visible(number)) candidates.push_back(names_[number]);
  std::sort(candidates.begin(), candidates.end());
  return closest_name(name, candidates);
}

void NameTable::grow() {
  std::vector<Slot> old(std::max<size_t>(16, 2 * slots_.size()));
  old.swap(slots_);
  for (const Slot& slot : old) {
    if (slot.number_plus_one == 0) continue;
    size_t i = slot.hash & (slots_.size() - 1);
    while (slots_[i].number_plus_one != 0) i = (i + 1) & (slots_.size() - 1);
    slots_[i] = slot;
  }
}

std::string_view NameTable::keep(std::string_view name) {
  constexpr size_t kPiece = 4096;
  if (name.size() > room_bytes_) {
    room_bytes_ = std::max(kPiece, name.size());
    text_.push_back(std::make_unique_for_overwrite<char[]>(room_bytes_));
    room_ = text_.back().get();
  }
  std::copy(name.begin(), name.end(), room_);
  const std::string_view kept(room_, name.size());
  room_ += name.size();
  room_bytes_ -= name.size();
  return kept;
}

} // namespace packtrace
