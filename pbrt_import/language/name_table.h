#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace packtrace {

/// Assigns numbers to names, in order of first use. Names are never removed.
class NameTable {
public:
  /// Number of a name, which is added if it is new.
  uint32_t intern(std::string_view name);
  std::optional<uint32_t> find(std::string_view name) const;

  /// Name that `name` is most likely a misspelling of; the alphabetically first if several are equally close; empty if
  /// none is. After a million comparisons in total it always returns empty, so that scenes with many mistakes are not
  /// slow.
  /// @param visible by number: whether the name may be suggested
  std::string_view closest(std::string_view name, const std::function<bool(uint32_t)>& visible) const;

  /// @param number below size()
  /// @return view that lives as long as the table
  std::string_view name(uint32_t number) const { return names_[number]; }
  uint32_t size() const { return static_cast<uint32_t>(names_.size()); }

private:
  struct Slot {
    uint32_t hash = 0;
    uint32_t number_plus_one = 0; ///< 0: free slot
  };
  /// Index of the slot that holds the name, or of the free slot where it belongs. Precondition: a slot is free.
  size_t find_slot(std::string_view name, uint32_t hash) const;
  void grow();
  std::string_view keep(std::string_view name);

  std::vector<Slot> slots_; ///< open addressing; the size is a power of two
  std::vector<std::string_view> names_;
  std::vector<std::unique_ptr<char[]>> text_; ///< storage of names_
  char* room_ = nullptr;                      ///< free space in the last block of text_
  size_t room_bytes_ = 0;
  mutable uint64_t compared_ = 0; ///< names compared by closest() so far
};

} // namespace packtrace
