#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/language/texture_graph.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Context for reading a texture, material or shape, besides its parameters.
struct TextureContext {
  const GraphicsState& state;
  FileNames& file_names;
  TextureGraph& graph;
  Reporter& reporter;
  Place place; ///< position of the directive
};

/// Reads parameters that may be constants or names of textures. As in pbrt, a shape's parameters take precedence over
/// its material's. Problems are reported, and the default is used.
class TextureParameters {
public:
  using Node = TextureGraph::Node;

  /// @param first list that takes precedence
  /// @param second list of lower precedence; may be null
  TextureParameters(const TextureContext& context, const ParameterList& first, const ParameterList* second = nullptr)
      : context_(context), first_(first), second_(second) {}

  /// Texture node of a spectrum parameter; nullopt if it is absent or unusable.
  std::optional<Node> find_spectrum(std::string_view name) const;
  Node spectrum(std::string_view name, Vec3 fallback) const;
  std::optional<Node> find_float(std::string_view name) const;
  Node float_texture(std::string_view name, float fallback) const;

  /// Value of a spectrum parameter that cannot be textured, such as a light's.
  Vec3 constant_spectrum(std::string_view name, Vec3 fallback) const;

  /// Whether a texture or value of this name exists. Marks it as used.
  bool has(std::string_view name) const;
  float get_float(std::string_view name, float fallback) const;
  bool get_bool(std::string_view name, bool fallback) const;
  std::string get_string(std::string_view name, std::string_view fallback) const;
  /// File name of a spectrum parameter that is given as a file; empty if there is none.
  std::string_view spectrum_file(std::string_view name) const;
  void mark_used(std::span<const std::string_view> names) const;

  enum class Kind { kFloat, kSpectrum, kBool, kString };
  /// Reads a parameter whose value is not needed, unless it has been read already, to report mistakes in it.
  void check(std::string_view name, Kind kind) const;

  const TextureContext& context() const { return context_; }

private:
  const Parameter* find(std::string_view name, std::initializer_list<ParameterType> types) const;
  std::optional<Node> find_texture(const Parameter& parameter, const ScopedNames& names, const ScopedNames& others,
                                   std::string_view kind) const;
  std::optional<Vec3> rgb_value(const Parameter& parameter) const;
  std::optional<Vec3> rgb_from_file(const Parameter& parameter) const;

  const TextureContext& context_;
  const ParameterList& first_;
  const ParameterList* second_;
};

} // namespace packtrace
