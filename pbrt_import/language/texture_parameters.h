#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parameters.h"
#include "pbrt_import/text/reporter.h"
#include "pbrt_import/language/texture_graph.h"

namespace packtrace {

/// What reading a texture, material or shape needs besides its parameters.
struct TextureContext {
  const GraphicsState& state;
  FileNames& file_names;
  TextureGraph& graph;
  Reporter& reporter;
  Place place; ///< of the directive
};

/// Parameters that may be constants or name textures, of a shape first, then of its material: pbrt's order. Problems
/// are reported and leave the default.
class TextureParameters {
public:
  using Node = TextureGraph::Node;

  /// @param second null: there is only one list
  TextureParameters(const TextureContext& context, const ParameterList& first, const ParameterList* second = nullptr)
      : context_(context), first_(first), second_(second) {}

  /// Texture node of a spectrum; none if the parameter is absent or unusable.
  std::optional<Node> find_spectrum(std::string_view name) const;
  Node spectrum(std::string_view name, Vec3 fallback) const;
  std::optional<Node> find_float(std::string_view name) const;
  Node float_texture(std::string_view name, float fallback) const;

  /// A spectrum that cannot be textured, for example a light's.
  Vec3 constant_spectrum(std::string_view name, Vec3 fallback) const;

  /// Whether a texture or value of that name is there, without needing it.
  bool has(std::string_view name) const;
  float get_float(std::string_view name, float fallback) const;
  std::string get_string(std::string_view name, std::string_view fallback) const;
  /// The file name of a spectrum parameter given as a file; empty: none.
  std::string_view spectrum_file(std::string_view name) const;
  void mark_used(std::span<const std::string_view> names) const;

  enum class Kind { kFloat, kSpectrum, kBool, kString };
  /// Reads a parameter whose value is not needed, as far as nobody has yet: mistakes in it are reported.
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
