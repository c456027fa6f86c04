#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace packtrace {

/// Numbers for names, in order of first use. Names are never forgotten.
class NameTable {
public:
  /// The name's number, a new one if it is new.
  uint32_t intern(std::string_view name);
  std::optional<uint32_t> find(std::string_view name) const;

  /// The name that name is most likely a misspelling of, the first in the alphabet of several; empty: none. A broken
  /// file must not become a slow one: after a million comparisons in all there are no more hints.
  /// @param visible tells by number which names may be given
  std::string_view closest(std::string_view name, const std::function<bool(uint32_t)>& visible) const;

  /// @param number below size(); the view lives as long as the table
  std::string_view name(uint32_t number) const { return names_[number]; }
  uint32_t size() const { return static_cast<uint32_t>(names_.size()); }

private:
  struct Slot {
    uint32_t hash = 0;
    uint32_t number_plus_one = 0; ///< 0: free
  };
  /// The slot that holds name, or the free one where it belongs. There must be a free one.
  size_t find_slot(std::string_view name, uint32_t hash) const;
  void grow();
  std::string_view keep(std::string_view name);

  std::vector<Slot> slots_; ///< open addressing, size a power of two
  std::vector<std::string_view> names_;
  std::vector<std::unique_ptr<char[]>> text_; ///< what names_ look at
  char* room_ = nullptr;                      ///< in the last of text_
  size_t room_bytes_ = 0;
  mutable uint64_t compared_ = 0; ///< names, to find hints
};

} // namespace packtrace
