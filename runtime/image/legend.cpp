#include "runtime/image/legend.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include <stb/stb_easy_font.h>

namespace packtrace {
namespace {

// Sizes in pixels at scale 1. A line of text has 7 pixels for capitals and 2 for descenders.
constexpr uint32_t kMargin = 4, kText = 9, kBar = 8, kGap = 3;
constexpr uint32_t kHeight = kMargin + kText + kGap + kBar + kGap + kText + kMargin;
constexpr uint32_t kWidthPerScale = 640;
constexpr Vec3 kPaper(0.96f), kInk(0.12f);

uint32_t scale_of(uint32_t width) { return std::max(1u, width / kWidthPerScale); }

/// The vertex layout of stb_easy_font_print(): a corner of an axis-aligned rectangle, in pixels at scale 1.
struct Vertex {
  float x, y, z;
  std::array<unsigned char, 4> color;
};
static_assert(sizeof(Vertex) == 16);

class Strip {
public:
  Strip(Image& image, uint32_t top) : image_(image), top_(top), scale_(scale_of(image.size.width)) {
    fill(0, 0, image.size.width, kHeight * scale_, kPaper);
  }

  uint32_t scale() const { return scale_; }

  /// Width of a line of text in pixels.
  uint32_t text_width(std::string text) const {
    return static_cast<uint32_t>(stb_easy_font_width(text.data())) * scale_;
  }

  /// @param x, y upper left corner of the text relative to that of the strip, pixels
  void draw_text(uint32_t x, uint32_t y, std::string text) {
    constexpr size_t kMaxQuads = 4096;
    std::vector<Vertex> corners(kMaxQuads * 4);
    const int quads = stb_easy_font_print(0, 0, text.data(), nullptr, corners.data(),
                                          static_cast<int>(corners.size() * sizeof(Vertex)));
    for (int quad = 0; quad < quads; ++quad) {
      const Vertex &first = corners[static_cast<size_t>(quad) * 4], &last = corners[static_cast<size_t>(quad) * 4 + 2];
      const auto pixels = [&](float units) { return static_cast<uint32_t>(std::max(units, 0.0f)) * scale_; };
      fill(x + pixels(first.x), y + pixels(first.y), pixels(last.x - first.x), pixels(last.y - first.y), kInk);
    }
  }

  /// Fills a rectangle, clipped to the image.
  void fill(uint32_t x, uint32_t y, uint32_t width, uint32_t height, Vec3 color) {
    const uint32_t right = std::min(x + width, image_.size.width);
    const uint32_t bottom = std::min(top_ + y + height, image_.size.height);
    for (uint32_t row = top_ + y; row < bottom; ++row)
      for (uint32_t column = x; column < right; ++column) {
        const std::span<float> pixel = image_.pixel(column, row);
        std::copy_n(&color.x, 3, pixel.begin());
        if (pixel.size() == 4) pixel[3] = 1.0f;
      }
  }

private:
  Image& image_;
  uint32_t top_, scale_;
};

void draw(Strip& strip, uint32_t width, const Legend& legend) {
  const uint32_t s = strip.scale(), margin = std::min(kMargin * s, width / 4), bar_width = width - 2 * margin;
  const uint32_t bar_top = (kMargin + kText + kGap) * s, text_top = bar_top + (kBar + kGap) * s;
  if (strip.text_width(legend.title) <= bar_width) strip.draw_text(margin, kMargin * s, legend.title);
  strip.fill(margin > s ? margin - s : 0, bar_top - s, bar_width + 2 * s, (kBar + 2) * s,
             kInk); // a dark frame, so that pale colours at the bar's ends remain visible
  for (uint32_t x = 0; x < bar_width; ++x)
    strip.fill(margin + x, bar_top, 1, kBar * s,
               legend.color((static_cast<float>(x) + 0.5f) / static_cast<float>(bar_width)));
  uint32_t free_from = 0; // labels that would touch the previous label or the bar's last label are left out
  const auto place = [&](const std::pair<float, std::string>& tick) {
    const uint32_t text = strip.text_width(tick.second), most = width > text ? width - text : 0;
    const auto middle = margin + static_cast<uint32_t>(tick.first * static_cast<float>(bar_width));
    return std::pair(std::min(middle > text / 2 ? middle - text / 2 : 0, most), text);
  };
  for (size_t i = 0; i < legend.ticks.size(); ++i) {
    const auto [x, text] = place(legend.ticks[i]);
    const bool is_last = i + 1 == legend.ticks.size();
    const uint32_t last_x = is_last ? width : place(legend.ticks.back()).first;
    if (text > width || x < free_from || (!is_last && x + text + 2 * s > last_x)) continue;
    strip.draw_text(x, text_top, legend.ticks[i].second);
    free_from = x + text + 2 * s;
  }
}

} // namespace

uint32_t legend_height(uint32_t width) { return kHeight * scale_of(width); }

Image with_legend(const Image& picture, const Legend& legend) {
  Image result({picture.size.width, picture.size.height + legend_height(picture.size.width)}, picture.channels);
  std::ranges::copy(picture.data, result.data.begin());
  Strip strip(result, picture.size.height);
  draw(strip, picture.size.width, legend);
  return result;
}

Legend banded_legend(std::string title, const std::vector<std::pair<Vec3, std::string>>& bands) {
  Legend legend{std::move(title), {}, {}};
  const auto count = static_cast<float>(bands.size());
  for (size_t i = 0; i < bands.size(); ++i)
    legend.ticks.emplace_back((static_cast<float>(i) + 0.5f) / count, bands[i].second);
  legend.color = [bands, count](float t) {
    return bands[std::min(static_cast<size_t>(t * count), bands.size() - 1)].first;
  };
  return legend;
}

std::vector<std::pair<float, std::string>> even_ticks(const std::function<double(float)>& value_at) {
  constexpr int kSteps = 4;
  std::vector<std::pair<float, std::string>> ticks;
  for (int i = 0; i <= kSteps; ++i) {
    const float t = static_cast<float>(i) / kSteps;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value_at(t));
    ticks.emplace_back(t, text.data());
  }
  return ticks;
}

} // namespace packtrace
