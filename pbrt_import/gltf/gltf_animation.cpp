#include "pbrt_import/gltf/gltf_animation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <glm/gtc/quaternion.hpp>

#include "pbrt_import/gltf/gltf_accessors.h"
#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace::gltf {
namespace {

/// The number that the whole text is.
std::optional<size_t> whole_number(const std::string& text) {
  size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

} // namespace

Value Animation::chosen(Document& document) {
  const std::optional<std::string>& wanted = document.context().options.animation;
  const size_t count = document.count("animations");
  if (!wanted) {
    if (count > 1)
      document.context().feed.reporter().note(document.place(),
                                              "of several animations the first is used; --animation names another");
    return document.element("animations", 0);
  }
  std::string names;
  for (size_t i = 0; i < count; ++i) {
    const Value animation = document.element("animations", i);
    const std::string name = animation.text_or("name", "");
    if (!name.empty() && name == *wanted) return animation;
    names += (i == 0 ? "" : ", ") + std::to_string(i) + (name.empty() ? "" : " (" + in_quotes(name) + ")");
  }
  if (const std::optional<size_t> number = whole_number(*wanted); number && *number < count)
    return document.element("animations", *number);
  throw Error(ErrorKind::kInput, "there is no animation " + in_quotes(*wanted) +
                                     (count == 0 ? "; the document has none" : "; there are " + names));
}

Animation::Animation(Document& document) {
  if (document.count("animations") == 0 && !document.context().options.animation) return;
  const Value animation = chosen(document);
  Samplers samplers;
  const auto report = [&](const std::string& problem, const char* consequence) {
    if (!problem.empty()) document.context().feed.reporter().error(document.place(), problem + consequence);
  };
  const std::string no_channels = problem_of([&] {
    const Value channels = animation.at("channels");
    for (size_t i = 0; i < channels.size(); ++i)
      report(problem_of([&] { read_channel(document, animation, channels[i], samplers); }),
             "; the channel is left out");
  });
  report(no_channels, "; nothing is animated");
}

Animation::Sampler Animation::read_sampler(Document& document, const Value& sampler) {
  const std::string name = sampler.text_or("interpolation", "LINEAR");
  if (name != "LINEAR" && name != "STEP" && name != "CUBICSPLINE") sampler.fail("has an unknown interpolation");
  Sampler read;
  if (name != "LINEAR") read.interpolation = name == "STEP" ? Interpolation::kStep : Interpolation::kCubicSpline;
  const ValuesInUse in_use(document);
  AccessorValues times = read_floats(document, sampler.at("input").integer());
  AccessorValues values = read_floats(document, sampler.at("output").integer());
  const uint64_t keys = times.count * (read.interpolation == Interpolation::kCubicSpline ? 3 : 1);
  if (times.components != 1 || keys == 0 || values.values.empty() || values.values.size() % keys != 0)
    sampler.fail("has times and values that do not fit each other");
  for (size_t i = 0; i < times.values.size(); ++i)
    if (!std::isfinite(times.values[i]) || (i > 0 && !(times.values[i] > times.values[i - 1])))
      sampler.fail("has times that do not increase");
  if (!std::ranges::all_of(values.values, [](float v) { return std::isfinite(v); }))
    sampler.fail("has values that are not finite");
  document.memory().resize(document.memory().bytes() + (times.values.size() + values.values.size()) * sizeof(float),
                           "the glTF document's animation");
  read.times = std::move(times.values), read.values = std::move(values.values);
  return read;
}

void Animation::read_channel(Document& document, const Value& animation, const Value& channel, Samplers& samplers) {
  const Value target = channel.at("target");
  const std::optional<uint64_t> node = target.find_integer("node");
  const std::string path = target.at("path").text();
  if (!node) return;
  Channel read;
  if (path == "rotation")
    read.path = Path::kRotation;
  else if (path == "weights")
    read.path = Path::kWeights;
  else if (path == "scale")
    read.path = Path::kScale;
  else if (path != "translation")
    target.fail("has an unknown path");
  if (document.element("nodes", *node).has("matrix") && read.path != Path::kWeights)
    target.fail("is a node with a matrix");
  if (const auto others = channels_.find(*node); others != channels_.end())
    for (const Channel& other : others->second)
      if (other.path == read.path) target.fail("is the target of another channel, too");
  const uint64_t number = channel.at("sampler").integer();
  const Value sampler = animation.at("samplers")[static_cast<size_t>(number)];
  std::shared_ptr<const Sampler>& shared = samplers[number];
  if (!shared) shared = std::make_shared<const Sampler>(read_sampler(document, sampler));
  const size_t keys = shared->times.size() * (shared->interpolation == Interpolation::kCubicSpline ? 3 : 1);
  const size_t components = shared->values.size() / keys;
  if (read.path != Path::kWeights && components != (read.path == Path::kRotation ? 4u : 3u))
    sampler.fail("has times and values that do not fit each other");
  read.sampler = shared;
  const double begin = double{shared->times.front()}, end = double{shared->times.back()};
  const bool first = channels_.empty();
  span_ = {first ? begin : std::min(span_.begin_s, begin), first ? end : std::max(span_.end_s, end)};
  channels_[*node].push_back(std::move(read));
}

/// Source: glTF 2.0 specification, appendix C.
std::vector<double> Animation::evaluate(const Channel& channel, double time) {
  const Sampler& sampler = *channel.sampler;
  const std::vector<float>& times = sampler.times;
  const bool cubic = sampler.interpolation == Interpolation::kCubicSpline;
  const size_t stride = sampler.values.size() / times.size(), components = stride / (cubic ? 3 : 1);
  const auto value = [&](size_t key, size_t i) {
    return double{sampler.values[key * stride + (cubic ? components : 0) + i]};
  };
  std::vector<double> result(components);
  const auto after = std::ranges::upper_bound(times, time, {}, [](float t) { return double{t}; });
  const auto next = static_cast<size_t>(after - times.begin());
  if (next == 0 || next == times.size() || sampler.interpolation == Interpolation::kStep) {
    for (size_t i = 0; i < components; ++i) result[i] = value(next == 0 ? 0 : next - 1, i);
    return result;
  }
  const size_t key = next - 1;
  const double span = double{times[next]} - double{times[key]}, t = (time - double{times[key]}) / span;
  if (!cubic && channel.path == Path::kRotation) { // rotations are interpolated on the sphere
    const auto quaternion = [&](size_t k) {
      return glm::normalize(glm::dquat(value(k, 3), value(k, 0), value(k, 1), value(k, 2)));
    };
    const glm::dquat q = glm::slerp(quaternion(key), quaternion(next), t);
    return {q.x, q.y, q.z, q.w};
  }
  for (size_t i = 0; i < components; ++i) {
    if (!cubic) {
      result[i] = value(key, i) + (value(next, i) - value(key, i)) * t;
      continue;
    }
    const double out = span * double{sampler.values[key * stride + 2 * components + i]},
                 in = span * double{sampler.values[next * stride + i]};
    const double t2 = t * t, t3 = t2 * t;
    result[i] = (2 * t3 - 3 * t2 + 1) * value(key, i) + (t3 - 2 * t2 + t) * out + (3 * t2 - 2 * t3) * value(next, i) +
                (t3 - t2) * in;
  }
  return result;
}

bool Animation::moves(uint64_t node) const {
  const auto found = channels_.find(node);
  return found != channels_.end() &&
         std::ranges::any_of(found->second, [](const Channel& channel) { return channel.path != Path::kWeights; });
}

bool Animation::morphs(uint64_t node) const {
  const auto found = channels_.find(node);
  return found != channels_.end() &&
         std::ranges::any_of(found->second, [](const Channel& channel) { return channel.path == Path::kWeights; });
}

double Animation::repeated(double time) const {
  const double period = span_.end_s - span_.begin_s;
  if (!(period > 0.0)) return time;
  const double rest = std::fmod(time - span_.begin_s, period);
  return span_.begin_s + (rest < 0.0 ? rest + period : rest);
}

AnimatedValues Animation::at(uint64_t node, double time) const {
  AnimatedValues set;
  const auto found = channels_.find(node);
  if (found == channels_.end()) return set;
  for (const Channel& channel : found->second) {
    std::vector<double> value = evaluate(channel, time);
    switch (channel.path) {
    case Path::kTranslation:
      set.translation = std::move(value);
      break;
    case Path::kRotation:
      set.rotation = std::move(value);
      break;
    case Path::kScale:
      set.scale = std::move(value);
      break;
    case Path::kWeights:
      set.weights = std::move(value);
      break;
    }
  }
  return set;
}

void Animation::add_times(uint64_t node, std::vector<double>& times) const {
  const auto found = channels_.find(node);
  if (found == channels_.end()) return;
  for (const Channel& channel : found->second) {
    if (channel.path == Path::kWeights) continue;
    for (const float key : channel.sampler->times) {
      if (channel.sampler->interpolation == Interpolation::kStep && key > channel.sampler->times.front())
        times.push_back(std::nextafter(double{key}, -std::numeric_limits<double>::infinity()));
      times.push_back(double{key});
    }
  }
}

uint64_t Animation::max_times(uint64_t node) const {
  const auto found = channels_.find(node);
  uint64_t count = 2; // and those of the span
  if (found != channels_.end())
    for (const Channel& channel : found->second) count += 2 * channel.sampler->times.size();
  return count;
}

bool Animation::curved(uint64_t node) const {
  const auto found = channels_.find(node);
  return found != channels_.end() && std::ranges::any_of(found->second, [](const Channel& channel) {
           return channel.path != Path::kWeights && channel.sampler->interpolation == Interpolation::kCubicSpline;
         });
}

} // namespace packtrace::gltf
