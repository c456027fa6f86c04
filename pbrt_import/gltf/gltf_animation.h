#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace::gltf {

/// Values that an animation sets for a node at a time.
struct AnimatedValues {
  std::optional<std::vector<double>> translation, rotation, scale, weights;
};

/// One animation of a document. Values hold before the first and after the last key of their channel.
class Animation {
public:
  /// Reads the animation that ImportOptions::animation names, by default the first. A malformed channel is reported and
  /// ends the animation. Throws Error(kInput) if the document has no animation of that name or number; MemoryError.
  explicit Animation(Document& document);

  /// Whether a channel sets a node's translation, rotation or scale.
  bool moves(uint64_t node) const;
  /// Whether a channel sets weights of a node's morph targets.
  bool morphs(uint64_t node) const;
  /// Whether it has no channels.
  bool empty() const { return channels_.empty(); }
  /// From the first to the last key of all channels.
  TimeSpan span() const { return span_; }

  /// The time within the span at which a time is shown, since the animation repeats.
  double repeated(double time) const;

  AnimatedValues at(uint64_t node, double time) const;

  /// Appends the times between which a node's translation, rotation and scale have no corner and no jump: its keys and,
  /// before the end of each step, the last double.
  void add_times(uint64_t node, std::vector<double>& times) const;
  /// At least as many as add_times() adds.
  uint64_t max_times(uint64_t node) const;
  /// Whether a channel of the node's translation, rotation or scale is a cubic spline.
  bool curved(uint64_t node) const;

private:
  enum class Interpolation : uint8_t { kLinear, kStep, kCubicSpline };
  enum class Path : uint8_t { kTranslation, kRotation, kScale, kWeights };
  struct Sampler {
    Interpolation interpolation = Interpolation::kLinear;
    std::vector<float> times, values; ///< times increase; values by key, of splines in-tangent, value, out-tangent
  };
  struct Channel {
    Path path = Path::kTranslation;
    std::shared_ptr<const Sampler> sampler;
  };
  using Samplers = std::map<uint64_t, std::shared_ptr<const Sampler>>;

  static Value chosen(Document& document);
  static Sampler read_sampler(Document& document, const Value& sampler);
  void read_channel(Document& document, const Value& animation, const Value& channel, Samplers& samplers);
  static std::vector<double> evaluate(const Channel& channel, double time);

  std::map<uint64_t, std::vector<Channel>> channels_; ///< by node
  TimeSpan span_;
};

} // namespace packtrace::gltf
