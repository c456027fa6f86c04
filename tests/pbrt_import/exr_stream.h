#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include <OpenEXR/ImfIO.h>

namespace packtrace {

/// Output stream of OpenEXR into a string.
class StringStream : public Imf::OStream {
public:
  StringStream() : Imf::OStream("image") {}
  void write(const char c[], int n) override {
    text_.resize(std::max(text_.size(), position_ + static_cast<size_t>(n)));
    std::memcpy(text_.data() + position_, c, static_cast<size_t>(n));
    position_ += static_cast<size_t>(n);
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = static_cast<size_t>(position); }
  const std::string& text() const { return text_; }

private:
  std::string text_;
  size_t position_ = 0;
};

} // namespace packtrace
