#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/scene/math.h"
#include "pbrt_import/text/number_array.h"

namespace packtrace {

/// Position in a file of an import; SourceFiles converts it to a SourceLocation.
struct Place {
  uint32_t file = 0;
  uint32_t line = 0;
  uint32_t column = 0;
  bool operator==(const Place&) const = default;
};

/// pbrt-v3's parameter types. Synonyms are merged: point is point3, vector is vector3, color is rgb.
enum class ParameterType : uint8_t {
  kInteger,
  kFloat,
  kBool,
  kString,
  kTexture,
  kPoint2,
  kVector2,
  kPoint3,
  kVector3,
  kNormal,
  kRgb,
  kXyz,
  kBlackbody,
  kSpectrum,
};

std::optional<ParameterType> parameter_type(std::string_view name);
std::string_view to_string(ParameterType type);
/// Type name that `name` is most likely a misspelling of; empty if none is close.
std::string_view closest_parameter_type(std::string_view name);

/// One parameter, `"type name" [ values ]`. Its values are in the array that fits the type.
struct Parameter {
  ParameterType type = ParameterType::kFloat;
  std::string name;
  Place place;
  FloatArray floats;                ///< components of points, vectors and spectra one after the other
  IntegerArray integers;            ///< values of integer; of bool as 0 or 1
  std::vector<std::string> strings; ///< string, texture and spectrum file names, escapes not yet replaced
  mutable bool used = false;        ///< whether it was looked up with its type

  /// Removes the values, but keeps small blocks of memory for the next ones.
  void clear() {
    constexpr size_t kSmall = 64;
    if (strings.capacity() > kSmall) strings = {};
    if (name.capacity() > kSmall) name = {};
    floats.clear(), integers.clear(), strings.clear();
    used = false;
  }
};

/// The parameter as `"type name"` for messages.
std::string describe(const Parameter& parameter);

/// The parameters of one directive. If a name and type occur twice, the last one wins. Looking up a parameter marks it
/// as used; unused parameters are reported as mistakes of the scene.
class ParameterList {
public:
  ParameterList() = default;
  ParameterList(const ParameterList& other)
      : parameters_(other.all().begin(), other.all().end()), count_(other.count_), index_(other.index_),
        types_(other.types_), looked_up_(other.looked_up_) {}
  ParameterList(ParameterList&& other) noexcept { swap(other); }
  ParameterList& operator=(ParameterList other) noexcept {
    swap(other);
    return *this;
  }
  ~ParameterList() = default;

  /// Appends a parameter without values, which is filled in through last(). Then call keep() or drop().
  Parameter& append() {
    if (count_ == parameters_.size()) parameters_.emplace_back();
    return parameters_[count_++];
  }
  Parameter& last() { return parameters_[count_ - 1]; }
  /// Keeps the last parameter. It replaces an earlier one of the same name and type.
  /// @return null if it replaces none; otherwise its new location
  const Parameter* keep();
  void drop() { parameters_[--count_].clear(); }
  void clear() {
    constexpr size_t kKeptForReuse = 32;
    if (parameters_.size() > kKeptForReuse) parameters_ = {}, count_ = 0;
    while (count_ > 0) drop();
    looked_up_.clear(), types_ = 0;
    if (!index_.empty()) index_ = {}; // also frees its buckets
  }
  bool empty() const { return count_ == 0; }
  std::span<const Parameter> all() const { return {parameters_.data(), count_}; }

  /// Finds a parameter by name with one of the types and marks it as used; null if there is none.
  const Parameter* find(std::string_view name, std::initializer_list<ParameterType> types) const {
    uint32_t bits = 0;
    for (const ParameterType type : types) bits |= bit_of(type);
    return find_type_in(bits, name);
  }

  /// Finds a parameter by name and type without marking it as used; null if there is none.
  const Parameter* peek(std::string_view name, ParameterType type) const;

  /// Value of a parameter that holds exactly one value; otherwise the fallback.
  float get_float(std::string_view name, float fallback) const;
  int32_t get_integer(std::string_view name, int32_t fallback) const;
  bool get_bool(std::string_view name, bool fallback) const;
  std::string get_string(std::string_view name, std::string_view fallback) const;
  Vec3 get_point(std::string_view name, Vec3 fallback) const;

  /// All values of a parameter; empty if there is no such parameter.
  std::span<const float> floats(std::string_view name, ParameterType type) const;
  std::span<const int32_t> integers(std::string_view name) const;

  /// Moves out all values of a parameter in groups of three; empty if there is no such parameter.
  std::vector<Vec3> take_vectors(std::string_view name, ParameterType type);
  std::vector<Triangle> take_triangles(std::string_view name);

  /// Marks the parameters with these names as used, whatever their types.
  void mark_used(std::span<const std::string_view> names) const;

  /// Of the names looked up so far, the one that `name` is most likely a misspelling of; empty if none is close.
  std::string_view suggestion(std::string_view name) const;
  bool was_looked_up(std::string_view name) const;

private:
  static constexpr uint32_t bit_of(ParameterType type) { return 1u << static_cast<uint32_t>(type); }
  const Parameter* find_type_in(uint32_t type_bits, std::string_view name) const;

  void swap(ParameterList& other) noexcept {
    parameters_.swap(other.parameters_);
    std::swap(count_, other.count_);
    index_.swap(other.index_);
    std::swap(types_, other.types_);
    looked_up_.swap(other.looked_up_);
  }

  std::vector<Parameter> parameters_; ///< those from count_ on have no values and are there for reuse
  size_t count_ = 0;
  std::unordered_map<std::string, size_t> index_;   ///< index into parameters_ by type and name; empty for short lists
  uint32_t types_ = 0;                              ///< bit_of() of all parameters' types
  mutable std::vector<std::string_view> looked_up_; ///< names looked up, string literals, possibly with repeats
};

/// Returns `; did you mean "x"?`, or an empty string without a suggestion.
std::string did_you_mean(std::string_view suggestion);

} // namespace packtrace
