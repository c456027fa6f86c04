#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/builder/scene_builder.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Executes pbrt directives that are made by readers of other formats instead of read from text, so that every format
/// shares the importer's materials, textures, transforms and checks.
///
///   feed.begin("Shape", place, {"trianglemesh"});
///   feed.floats(ParameterType::kPoint3, "P", positions);
///   feed.integers("indices", indices);
///   feed.send();
class DirectiveFeed {
public:
  /// @param memory budget for large parameters
  DirectiveFeed(SceneBuilder& builder, Reporter& reporter, const MemoryBudget& memory)
      : builder_(builder), reporter_(reporter), memory_(memory) {}

  /// Starts a directive; the previous one must have been sent.
  /// @param keyword of a directive that find_directive() knows
  void begin(std::string_view keyword, const Place& place, std::initializer_list<std::string_view> names = {},
             std::span<const double> numbers = {});
  void floats(ParameterType type, std::string_view name, std::span<const float> values);
  void number(std::string_view name, float value) { floats(ParameterType::kFloat, name, {&value, 1}); }
  void colour(std::string_view name, Vec3 value) { floats(ParameterType::kRgb, name, {&value.x, 3}); }
  void integers(std::string_view name, std::span<const int32_t> values);
  void flag(std::string_view name, bool value);
  /// A string without escapes, such as a path.
  void text(std::string_view name, std::string_view value);
  void texture(std::string_view name, std::string_view texture);
  /// Sends a Transform or ConcatTransform.
  void transform(std::string_view keyword, const Place& place, const DAffine& map);
  /// Adds a track for moves(); returns its number.
  uint32_t add_track(MotionTrack track) { return builder_.add_track(std::move(track)); }
  /// Moves the ObjectInstance or Camera that is being made. The current transform is its place at the scene's time.
  void moves(const TrackedMotion& motion) { directive_.motion = motion; }
  /// Gives frames to the mesh of the current Shape, whose positions must be those of frame 0.
  void deforms(const MeshSequence& sequence) { directive_.sequence = builder_.add_sequence(sequence); }
  /// Executes the directive. Throws like SceneBuilder::handle(); MemoryError with the directive's place.
  void send();

  /// Executes directives between AttributeBegin and AttributeEnd, which is also sent if they throw.
  template <class Body>
  void with_attributes(const Place& place, const Body& body) {
    begin("AttributeBegin", place);
    send();
    try {
      body();
    } catch (...) {
      begin("AttributeEnd", place);
      send();
      throw;
    }
    begin("AttributeEnd", place);
    send();
  }

  Reporter& reporter() { return reporter_; }

private:
  Parameter& add(ParameterType type, std::string_view name);
  void reserve(uint64_t bytes);

  SceneBuilder& builder_;
  Reporter& reporter_;
  MemoryBudget memory_;
  Directive directive_;
};

} // namespace packtrace
