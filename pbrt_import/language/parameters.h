#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "pbrt_import/text/number_array.h"
#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A place in one of the files of an import; SourceFiles turns it into a SourceLocation.
struct Place {
  uint32_t file = 0;
  uint32_t line = 0;
  uint32_t column = 0;
  bool operator==(const Place&) const = default;
};

/// pbrt-v3's parameter types with synonyms folded: point is point3, vector is vector3, color is rgb.
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
/// The type's name that name is most likely a misspelling of; empty: none.
std::string_view closest_parameter_type(std::string_view name);

/// One `"type name" [ values ]`. Values are in the one vector that fits the type.
struct Parameter {
  ParameterType type = ParameterType::kFloat;
  std::string name;
  Place place;
  FloatArray floats;                ///< all kinds of points, vectors, spectra: components one after the other
  IntegerArray integers;            ///< integer, and bool as 0 or 1
  std::vector<std::string> strings; ///< string, texture, spectrum files: escapes not replaced yet
  mutable bool used = false;        ///< somebody asked for it with its type
};

/// `"type name"` for messages.
std::string describe(const Parameter& parameter);

/// The parameters of one directive. Where a name and type occur twice the last one wins. Looking a parameter up marks
/// it as used; what stays unused is a mistake in the scene worth reporting.
class ParameterList {
public:
  /// A new parameter to be filled in as last(); then keep() or drop() it.
  Parameter& append() { return parameters_.emplace_back(); }
  Parameter& last() { return parameters_.back(); }
  /// It replaces one of the same name and type, if there is one.
  /// @return null, or where it is now instead of the one before it
  const Parameter* keep();
  void drop() { parameters_.pop_back(); }
  void clear() {
    parameters_.clear(), asked_.clear(), types_ = 0;
    if (!index_.empty()) index_ = {}; // with its buckets
  }
  bool empty() const { return parameters_.empty(); }
  std::span<const Parameter> all() const { return parameters_; }

  /// The parameter of that name with one of those types; null if there is none.
  const Parameter* find(std::string_view name, std::initializer_list<ParameterType> types) const {
    uint32_t bits = 0;
    for (const ParameterType type : types) bits |= bit_of(type);
    return find_type_in(bits, name);
  }

  /// The same, but for one type and without marking it as used.
  const Parameter* peek(std::string_view name, ParameterType type) const;

  /// First value of a parameter with exactly one value, else the fallback.
  float get_float(std::string_view name, float fallback) const;
  int32_t get_integer(std::string_view name, int32_t fallback) const;
  bool get_bool(std::string_view name, bool fallback) const;
  std::string get_string(std::string_view name, std::string_view fallback) const;
  Vec3 get_point(std::string_view name, Vec3 fallback) const;
  Vec3 get_vector(std::string_view name, Vec3 fallback) const;

  /// All values; empty if there are none.
  std::span<const float> floats(std::string_view name, ParameterType type) const;
  std::span<const int32_t> integers(std::string_view name) const;

  /// Moves all values out in groups of three; empty if there are none.
  std::vector<Vec3> take_vectors(std::string_view name, ParameterType type);
  std::vector<Triangle> take_triangles(std::string_view name);

  /// Declares names as known without needing their values.
  void mark_used(std::span<const std::string_view> names) const;

  /// Among the names looked up so far, the one that name is most likely a misspelling of; empty: none is close.
  std::string_view suggestion(std::string_view name) const;
  bool was_asked(std::string_view name) const;

private:
  static constexpr uint32_t bit_of(ParameterType type) { return 1u << static_cast<uint32_t>(type); }
  const Parameter* find_type_in(uint32_t type_bits, std::string_view name) const;

  std::vector<Parameter> parameters_;
  std::unordered_map<std::string, size_t> index_; ///< into parameters_ by type and name, where there are many
  uint32_t types_ = 0;                            ///< bit_of() all of them
  mutable std::vector<std::string_view> asked_;   ///< literals, some of them often
};

/// `; did you mean "x"?` or nothing.
std::string did_you_mean(std::string_view suggestion);

} // namespace packtrace
