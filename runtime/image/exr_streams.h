#pragma once

#include <cstring>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>

#include "pbrt_import/base/file_error.h"
#include "runtime/image/exr.h"

namespace packtrace {

// Shared code of the readers and writers of EXR files; not for other code.

/// Reads a file in memory.
class ExrMemoryReader : public Imf::IStream {
public:
  ExrMemoryReader(std::span<const std::byte> bytes, const std::string& name) : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char target[], int count) override {
    const size_t n = static_cast<size_t>(count);
    if (count < 0 || position_ > bytes_.size() || n > bytes_.size() - position_)
      throw std::runtime_error("the file ends too early");
    if (n > 0) std::memcpy(target, bytes_.data() + position_, n);
    position_ += n;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = position; }

private:
  std::span<const std::byte> bytes_;
  uint64_t position_ = 0;
};

/// Collects a file in memory. Writing it in one call afterwards reports a full disk reliably.
class ExrMemoryWriter : public Imf::OStream {
public:
  ExrMemoryWriter() : OStream("memory") {}
  void write(const char bytes[], int count) override {
    const size_t n = static_cast<size_t>(count);
    if (position_ + n > bytes_.size()) bytes_.resize(position_ + n);
    std::memcpy(bytes_.data() + position_, bytes, n);
    position_ += n;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }
  std::vector<std::byte> take() { return std::move(bytes_); }

private:
  std::vector<std::byte> bytes_;
  size_t position_ = 0;
};

[[noreturn]] inline void fail_exr(std::string_view name, const std::string& what, ErrorKind kind = ErrorKind::kInput) {
  throw FileError(kind, std::string(name), what);
}

/// A header that was checked before OpenEXR parsed it, and the size of its data window.
struct CheckedExrHeader {
  Imf::Header header;
  ImageSize size;
};

/// Reads the header of a file in memory. Throws like decode_exr(); call it within guarded_exr().
CheckedExrHeader read_exr_header(std::span<const std::byte> bytes, std::string_view name);

/// Runs a function that reads a file with OpenEXR, and turns OpenEXR's exceptions into an Error about this file.
template <class Function>
auto guarded_exr(std::string_view name, Function function) -> decltype(function()) {
  try {
    return function();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail_exr(name, "EXR file needs more memory than there is");
  } catch (const std::exception& error) {
    fail_exr(name, std::string("damaged EXR file: ") + error.what());
  }
}

/// Throws Error(kUnsupported) for a channel with fewer samples than pixels.
void require_full_sampling(const Imf::Header& header, const std::string& channel, std::string_view name);

/// The samples of layers, as OpenEXR writes them.
class ExrSlices {
public:
  /// Adds the channels of layers to a header and a frame buffer, replacing those of the same name. The frame buffer
  /// refers to this object and to the layers' samples. Throws like encode_exr().
  ExrSlices(ImageSize size, std::span<const Layer> layers, Imf::Header& header, Imf::FrameBuffer& frame);

private:
  std::vector<std::vector<half>> halves_;
};

/// Encodes the slices of a frame buffer, which are the header's channels. Throws Error(kIo) if OpenEXR fails.
std::vector<std::byte> write_exr(const Imf::Header& header, const Imf::FrameBuffer& frame, ImageSize size);

} // namespace packtrace
