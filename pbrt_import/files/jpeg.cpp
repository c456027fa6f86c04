#include "pbrt_import/files/jpeg.h"

#include <array>
#include <csetjmp>
#include <cstdio>
#include <vector>

#include <jpeglib.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// libjpeg reports errors by calling a function that must not return.
struct ErrorManager {
  jpeg_error_mgr base; ///< first member, so that libjpeg's pointer to it points to this object
  std::jmp_buf jump;
  std::array<char, JMSG_LENGTH_MAX> message;
};

void leave(j_common_ptr info) {
  auto* const errors = reinterpret_cast<ErrorManager*>(info->err);
  errors->base.format_message(info, errors->message.data());
  std::longjmp(errors->jump, 1);
}

/// Warnings are counted in num_warnings; the first one's text is kept.
void keep_warning(j_common_ptr info, int level) {
  if (level >= 0) return; // a trace message
  auto* const errors = reinterpret_cast<ErrorManager*>(info->err);
  if (errors->base.num_warnings++ == 0) errors->base.format_message(info, errors->message.data());
}

void ignore_output(j_common_ptr) {}

} // namespace

struct JpegReader::State {
  jpeg_decompress_struct decoder{};
  ErrorManager errors{};
  std::vector<uint8_t> row;

  State() {
    decoder.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = leave;
    errors.base.emit_message = keep_warning;
    errors.base.output_message = ignore_output;
  }
  ~State() { jpeg_destroy_decompress(&decoder); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  [[noreturn]] void fail() const {
    throw Error(ErrorKind::kInput, std::string("damaged image: ") + errors.message.data());
  }

  // The functions that call libjpeg hold no objects with destructors, because errors jump out of them.

  bool read_header(const unsigned char* data, unsigned long size) {
    if (setjmp(errors.jump) != 0) return false;
    jpeg_create_decompress(&decoder);
    jpeg_mem_src(&decoder, data, size);
    jpeg_read_header(&decoder, TRUE);
    decoder.out_color_space = JCS_RGB; // of CMYK, libjpeg makes nothing else, and reports that
    decoder.dct_method = JDCT_ISLOW;   // exact integers
    return true;
  }
  bool start() {
    if (setjmp(errors.jump) != 0) return false;
    jpeg_start_decompress(&decoder);
    return true;
  }
  bool read_row(unsigned char* to) {
    if (setjmp(errors.jump) != 0) return false;
    return jpeg_read_scanlines(&decoder, &to, 1) == 1;
  }
};

JpegReader::JpegReader(std::span<const std::byte> bytes) : state_(std::make_unique<State>()) {
  if (!state_->read_header(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size())) state_->fail();
}

JpegReader::~JpegReader() = default;

uint32_t JpegReader::width() const { return state_->decoder.image_width; }
uint32_t JpegReader::height() const { return state_->decoder.image_height; }

uint64_t JpegReader::working_bytes() const {
  const uint64_t pixels = uint64_t{width()} * height();
  constexpr uint64_t kRows = 64, kBytesPerPixel = 8, kCoefficientBytes = 2;
  return uint64_t{width()} * kRows * kBytesPerPixel +
         (state_->decoder.progressive_mode != 0 || state_->decoder.buffered_image != 0
              ? pixels * static_cast<uint64_t>(state_->decoder.num_components) * kCoefficientBytes
              : 0);
}

std::span<const uint8_t> JpegReader::read_row() {
  State& state = *state_;
  if (state.row.empty()) {
    if (!state.start()) state.fail();
    state.row.resize(size_t{width()} * 3);
  }
  if (!state.read_row(state.row.data())) state.fail();
  return state.row;
}

std::string JpegReader::problem() const {
  return state_->errors.base.num_warnings == 0 ? std::string() : state_->errors.message.data();
}

} // namespace packtrace
