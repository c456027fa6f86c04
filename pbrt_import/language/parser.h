#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/language/directive_info.h"
#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/scene/rigid_motion.h"
#include "pbrt_import/text/source_stack.h"

namespace packtrace {

/// Motion that readers of other formats give to an instance or a camera: world(t) = track(t) inner.
struct TrackedMotion {
  uint32_t track = kNoTrack; ///< number that SceneBuilder gave it
  DAffine inner{1.0};        ///< of instances; the identity for cameras
};

inline constexpr uint32_t kNoSequence = ~0u;

/// One directive with its arguments. It has as many numbers and names as its kind requires; MediumInterface has one or
/// two names, and names[0] of ActiveTransform is its word.
struct Directive {
  DirectiveKind kind = DirectiveKind::kIdentity;
  std::string_view keyword;
  Place place;
  std::array<double, 16> numbers{};
  std::array<std::string, 3> names; ///< quoted names, with escapes replaced
  uint32_t name_count = 0;
  ParameterList parameters;
  MemoryReservation memory;        ///< reservation for large parameters
  TrackedMotion motion;            ///< of ObjectInstance and Camera; never of text
  uint32_t sequence = kNoSequence; ///< of Shape: from SceneBuilder::add_sequence(); never of text
  bool damaged = false;            ///< its numbers or names are malformed, which was reported; only kind is valid
};

/// Reads directives one by one and follows Include. Malformed input is reported and costs as little as possible: one
/// parameter, or one directive if its names or numbers are malformed.
class Parser {
public:
  /// @param memory budget for the parameters of directives
  Parser(SourceStack& source, FileNames& file_names, Reporter& reporter, const MemoryBudget& memory = MemoryBudget())
      : source_(source), file_names_(file_names), reporter_(reporter), memory_(memory) {}

  /// Reads the next directive; returns false at the end of the main file. `directive` is reused, which invalidates
  /// spans into its parameters. Throws MemoryError.
  bool next(Directive& directive);

private:
  bool next_plain(Directive& directive);
  bool take_plain_matrix(PlainText& text, uint32_t count, std::array<double, 16>& numbers);
  bool take_plain_parameters(ParameterList& list);
  bool take_plain_parameter(ParameterList& list);
  struct PlainDeclaration {
    std::string text; ///< empty: none
    ParameterType type = ParameterType::kFloat;
    size_t name_begin = 0; ///< offset in text
  };
  const PlainDeclaration* plain_declaration(std::string_view text);
  bool take_plain_value(PlainText& text, Parameter& parameter);
  void begin(Directive& directive, const DirectiveInfo& info, const Place& place);
  bool read_arguments(const DirectiveInfo& info, Directive& directive);
  bool read_directive_numbers(const DirectiveInfo& info, Directive& directive);
  bool read_directive_names(const DirectiveInfo& info, Directive& directive);
  /// The string that declares a parameter.
  struct Declaration {
    std::string text;
    Place place;
  };
  void read_parameters(ParameterList& list);
  void read_value_of_last(ParameterList& list, bool declared);
  void keep_last(ParameterList& list);
  bool skip_stray_word();
  void skip_stray_value(const ParameterList& list);
  bool read_declaration(std::string_view text, Parameter& parameter);
  bool read_values(Parameter& parameter);
  bool read_array(Parameter& parameter);
  bool read_single(Parameter& parameter);
  bool take_string(Parameter& parameter);
  bool take_bool(Parameter& parameter);
  void cut_excess(Parameter& parameter);
  template <class Values>
  void read_number_run(Values& values);
  template <class Values>
  bool take_number(Values& values);
  void skip_value();
  void skip_array_rest();
  void skip_to_directive(uint32_t line);
  void report_unexpected(const std::string& expected, const std::string& consequence);
  /// Counts the memory of a value against the budget. Call before the value is stored.
  void count_value(uint64_t bytes) {
    value_bytes_ += bytes;
    if (value_bytes_ > kFreeBytes && value_bytes_ > directive_->memory.bytes()) reserve_values();
  }
  void reserve_values();

  static constexpr uint64_t kFreeBytes = 1u << 20; ///< not counted: enough for most directives
  /// Of a parameter itself: the list doubles its capacity as it grows.
  static constexpr uint64_t kParameterBytes = 2 * sizeof(Parameter);

  SourceStack& source_;
  FileNames& file_names_;
  Reporter& reporter_;
  std::vector<double> numbers_; ///< scratch buffer
  std::string include_name_;    ///< escapes not yet replaced
  std::optional<Declaration>
      misread_declaration_; ///< a declaration that was read as the value of the previous parameter
  MemoryBudget memory_;
  std::array<PlainDeclaration, 64> declarations_; ///< the last ones, by a hash of their text
  Directive* directive_ = nullptr;                ///< the directive being read
  uint64_t value_bytes_ = 0;                      ///< bytes of its parameters
};

} // namespace packtrace
