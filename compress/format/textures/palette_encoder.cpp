#include <algorithm>
#include <array>
#include <limits>
#include <queue>
#include <vector>

#include "compress/format/textures/texture_encoder.h"

namespace packtrace {
namespace {

constexpr size_t kColours = 256;
constexpr uint32_t kBinBits = 6; // per channel
constexpr int kRounds = 8;

/// Texels whose colours share their upper bits.
struct Bin {
  std::array<uint64_t, 3> sum{};
  uint64_t count = 0;
  std::array<double, 3> mean{};
};

double squared_distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double sum = 0.0;
  for (size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

std::vector<Bin> fill_bins(const AlbedoTexture& texture) {
  std::vector<Bin> bins(size_t{1} << (3 * kBinBits));
  for (size_t i = 0; i < texture.rgb.size(); i += 3) {
    size_t number = 0;
    for (size_t c = 0; c < 3; ++c) number = (number << kBinBits) | (texture.rgb[i + c] >> (8 - kBinBits));
    ++bins[number].count;
    for (size_t c = 0; c < 3; ++c) bins[number].sum[c] += texture.rgb[i + c];
  }
  std::erase_if(bins, [](const Bin& bin) { return bin.count == 0; });
  for (Bin& bin : bins)
    for (size_t c = 0; c < 3; ++c) bin.mean[c] = static_cast<double>(bin.sum[c]) / static_cast<double>(bin.count);
  return bins;
}

/// A range of bins that may become one colour.
struct Box {
  size_t begin = 0, end = 0;
  size_t axis = 0;    ///< axis of the largest variance
  double error = 0.0; ///< squared deviations of the texels along that axis, summed
  std::array<double, 3> mean{};
  bool operator<(const Box& other) const {
    return error < other.error || (error == other.error && begin > other.begin);
  }
};

Box measure(const std::vector<Bin>& bins, size_t begin, size_t end) {
  Box box{begin, end, 0, 0.0, {}};
  std::array<double, 3> sum{}, squares{};
  double count = 0.0;
  for (size_t i = begin; i < end; ++i) {
    const auto weight = static_cast<double>(bins[i].count);
    count += weight;
    for (size_t c = 0; c < 3; ++c)
      sum[c] += weight * bins[i].mean[c], squares[c] += weight * bins[i].mean[c] * bins[i].mean[c];
  }
  for (size_t c = 0; c < 3; ++c) {
    box.mean[c] = sum[c] / count;
    const double error = squares[c] - sum[c] * sum[c] / count;
    if (error > box.error) box.error = error, box.axis = c;
  }
  if (end - begin < 2) box.error = 0.0;
  return box;
}

/// Chooses colours by repeatedly splitting the box with the largest error at its mean, along its axis of largest
/// variance.
/// Source: Heckbert, "Color Image Quantization for Frame Buffer Display", 1982, with variance instead of extent.
std::vector<std::array<double, 3>> cut(std::vector<Bin>& bins) {
  std::priority_queue<Box> boxes;
  boxes.push(measure(bins, 0, bins.size()));
  while (boxes.size() < kColours && boxes.top().error > 0.0) {
    const Box box = boxes.top();
    const auto from = bins.begin() + static_cast<std::ptrdiff_t>(box.begin),
               to = bins.begin() + static_cast<std::ptrdiff_t>(box.end);
    const auto middle =
        std::stable_partition(from, to, [&](const Bin& bin) { return bin.mean[box.axis] <= box.mean[box.axis]; });
    const auto place = static_cast<size_t>(middle - bins.begin());
    if (place == box.begin || place == box.end) break; // rounding: the remaining bins do not differ
    boxes.pop();
    boxes.push(measure(bins, box.begin, place));
    boxes.push(measure(bins, place, box.end));
  }
  std::vector<std::array<double, 3>> colours;
  for (; !boxes.empty(); boxes.pop()) colours.push_back(boxes.top().mean);
  return colours;
}

size_t nearest(const std::vector<std::array<double, 3>>& colours, const std::array<double, 3>& colour) {
  size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < colours.size(); ++i) {
    const double d = squared_distance(colours[i], colour);
    if (d < least) least = d, best = i;
  }
  return best;
}

/// Moves each colour to the mean of the bins nearest to it.
/// Source: Lloyd, "Least Squares Quantization in PCM", 1982.
void relax(const std::vector<Bin>& bins, std::vector<std::array<double, 3>>& colours) {
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Bin> sums(colours.size());
    for (const Bin& bin : bins) {
      Bin& sum = sums[nearest(colours, bin.mean)];
      sum.count += bin.count;
      for (size_t c = 0; c < 3; ++c) sum.sum[c] += bin.sum[c];
    }
    for (size_t i = 0; i < colours.size(); ++i)
      for (size_t c = 0; c < 3 && sums[i].count > 0; ++c)
        colours[i][c] = static_cast<double>(sums[i].sum[c]) / static_cast<double>(sums[i].count);
  }
}

/// Returns all colours of the texture, sorted; empty if there are more than 256.
std::vector<Rgb8> all_colours_if_few(const AlbedoTexture& texture) {
  std::vector<Rgb8> colours;
  for (size_t i = 0; i < texture.rgb.size(); i += 3) {
    const Rgb8 colour{texture.rgb[i], texture.rgb[i + 1], texture.rgb[i + 2]};
    const auto place = std::lower_bound(colours.begin(), colours.end(), colour);
    if (place != colours.end() && *place == colour) continue;
    if (colours.size() == kColours) return {};
    colours.insert(place, colour);
  }
  return colours;
}

std::vector<Rgb8> choose_palette(const AlbedoTexture& texture) {
  std::vector<Rgb8> palette = all_colours_if_few(texture);
  if (!palette.empty()) return palette;
  std::vector<Bin> bins = fill_bins(texture);
  std::vector<std::array<double, 3>> colours = cut(bins);
  relax(bins, colours);
  for (const std::array<double, 3>& colour : colours)
    palette.push_back({static_cast<uint8_t>(std::min(colour[0] + 0.5, 255.0)),
                       static_cast<uint8_t>(std::min(colour[1] + 0.5, 255.0)),
                       static_cast<uint8_t>(std::min(colour[2] + 0.5, 255.0))});
  std::sort(palette.begin(), palette.end());
  palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
  return palette;
}

uint8_t nearest_entry(const std::vector<Rgb8>& palette, const uint8_t* rgb) {
  size_t best = 0;
  int32_t least = std::numeric_limits<int32_t>::max();
  for (size_t i = 0; i < palette.size(); ++i) {
    int32_t d = 0;
    for (size_t c = 0; c < 3; ++c) d += (palette[i][c] - rgb[c]) * (palette[i][c] - rgb[c]);
    if (d < least) least = d, best = i;
  }
  return static_cast<uint8_t>(best);
}

} // namespace

std::vector<uint8_t> encode_palette8(const AlbedoTexture& texture) {
  const std::vector<Rgb8> palette = choose_palette(texture);
  std::vector<uint8_t> data;
  data.reserve(kPaletteBytes + texture.rgb.size() / 3);
  for (const Rgb8& colour : palette) data.insert(data.end(), colour.begin(), colour.end());
  data.resize(kPaletteBytes);
  constexpr uint16_t kUnknown = 0xffff;
  std::vector<uint16_t> known(size_t{1} << 24, kUnknown); // palette entry per colour
  for (size_t i = 0; i < texture.rgb.size(); i += 3) {
    const uint8_t* const rgb = texture.rgb.data() + i;
    uint16_t& entry = known[(size_t{rgb[0]} << 16) | (size_t{rgb[1]} << 8) | rgb[2]];
    if (entry == kUnknown) entry = nearest_entry(palette, rgb);
    data.push_back(static_cast<uint8_t>(entry));
  }
  return data;
}

} // namespace packtrace
