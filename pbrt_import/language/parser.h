#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/language/directive_info.h"
#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/text/source_stack.h"

namespace packtrace {

/// One directive with all that belongs to it. Numbers and names are as many as the kind takes (MediumInterface: one or
/// two names; ActiveTransform: its word is names[0]).
struct Directive {
  DirectiveKind kind = DirectiveKind::kIdentity;
  std::string_view keyword;
  Place place;
  std::array<double, 16> numbers{};
  std::array<std::string, 3> names; ///< escapes replaced
  uint32_t name_count = 0;
  ParameterList parameters;
  MemoryReservation memory; ///< of the parameters, where they are many
  bool damaged = false; ///< its numbers or names could not be read, which was reported: nothing but its kind counts
};

/// Reads directives one after the other and follows Include. What is malformed is reported and costs as little as
/// possible: a parameter, or a directive that cannot do without its names or numbers.
class Parser {
public:
  /// @param memory for the parameters of directives
  Parser(SourceStack& source, FileNames& file_names, Reporter& reporter, const MemoryBudget& memory = MemoryBudget())
      : source_(source), file_names_(file_names), reporter_(reporter), memory_(memory) {}

  /// False at the end of the main file. directive is reused: spans into its parameters end here. Throws MemoryError.
  bool next(Directive& directive);

private:
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
  /// Call before a value of the directive is kept.
  void count_value(uint64_t bytes) {
    constexpr uint64_t kFree = 1u << 20; // most directives need no more
    value_bytes_ += bytes;
    if (value_bytes_ > kFree && value_bytes_ > directive_->memory.bytes()) reserve_values();
  }
  void reserve_values();

  SourceStack& source_;
  FileNames& file_names_;
  Reporter& reporter_;
  std::vector<double> numbers_;        ///< scratch
  std::string include_name_;           ///< escapes untouched
  std::optional<Declaration> misread_; ///< taken for the value of the parameter before it
  MemoryBudget memory_;
  Directive* directive_ = nullptr; ///< the one being read
  uint64_t value_bytes_ = 0;       ///< of its parameters
};

} // namespace packtrace
