#include "pbrt_import/text/input_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <string>

#include <unistd.h>
#include <zlib.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/regular_file.h"

namespace packtrace {
namespace {

[[noreturn]] void fail_reading(const std::string& what) { throw Error(ErrorKind::kInput, what); }

/// Owns a zlib inflate stream.
class Inflater {
public:
  Inflater() {
    constexpr int kGzipWindow = 15 + 16; // largest window; accept the gzip format only
    if (inflateInit2(&stream_, kGzipWindow) != Z_OK) fail_reading("cannot start inflating");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  z_stream& stream() { return stream_; }

private:
  z_stream stream_{};
};

constexpr size_t kCompressedChunk = 64 * 1024;

} // namespace

struct InputFile::State {
  RegularFile file;
  uint64_t max_bytes = 0;
  uint64_t delivered_bytes = 0;
  std::unique_ptr<Inflater> inflater; ///< null if the file is not compressed
  std::vector<unsigned char> compressed;
  const char* damage = nullptr; ///< message of damage found while inflating; null: none
  bool member_open = false;     ///< inside a gzip member, where an end of file means truncation

  /// @param read_some gets a pointer, a size and the number of bytes read so far; returns like POSIX read()
  template <class ReadSome>
  static size_t read_fully(char* to, size_t size, ReadSome read_some) {
    size_t got = 0;
    while (got < size) {
      const ssize_t n = read_some(to + got, std::min<size_t>(size - got, 1u << 30), got);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail_reading(std::string("reading failed: ") + std::strerror(errno));
      if (n == 0) break;
      got += static_cast<size_t>(n);
    }
    return got;
  }

  size_t read_plain(char* to, size_t size) {
    return read_fully(to, size, [&](char* p, size_t n, size_t) { return ::read(file.descriptor.get(), p, n); });
  }

  /// Refills the input buffer if it is empty; returns false at the end of the file.
  bool refill() {
    z_stream& z = inflater->stream();
    if (z.avail_in > 0) return true;
    const size_t n = read_plain(reinterpret_cast<char*>(compressed.data()), compressed.size());
    z.next_in = compressed.data();
    z.avail_in = static_cast<uInt>(n);
    return n > 0;
  }

  void check_limit(uint64_t bytes) const {
    if (bytes > max_bytes)
      throw Error(ErrorKind::kLimitExceeded,
                  "content exceeds the limit of " + std::to_string(max_bytes) + " bytes for this file");
  }

  /// Returns the bytes that precede damage first and reports the damage in the next call.
  size_t read_inflated(char* to, size_t size) {
    if (damage) fail_reading(damage);
    z_stream& z = inflater->stream();
    size_t got = 0;
    while (got < size && refill()) {
      if (!member_open) { // a gzip file may consist of several members
        if (inflateReset(&z) != Z_OK) fail_reading("cannot start inflating");
        member_open = true;
      }
      const auto room = static_cast<uInt>(std::min<size_t>(size - got, 1u << 30));
      z.next_out = reinterpret_cast<Bytef*>(to + got);
      z.avail_out = room;
      const int status = inflate(&z, Z_NO_FLUSH);
      got += room - z.avail_out;
      if (status == Z_STREAM_END) member_open = false;
      if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) {
        damage = "damaged gzip data";
        break;
      }
    }
    if (got < size && member_open && !damage) damage = "truncated gzip data";
    if (damage && got == 0) fail_reading(damage);
    return got;
  }
};

InputFile::InputFile(const std::filesystem::path& path, uint64_t max_bytes) {
  state_ = std::make_unique<State>();
  state_->file = open_regular_file(path);
  state_->max_bytes = max_bytes;
  unsigned char magic[2] = {};
  const ssize_t n = ::pread(state_->file.descriptor.get(), magic, sizeof magic, 0);
  if (n == 2 && magic[0] == 0x1f && magic[1] == 0x8b) {
    state_->inflater = std::make_unique<Inflater>();
    state_->compressed.resize(kCompressedChunk);
  }
}

InputFile::~InputFile() = default;
InputFile::InputFile(InputFile&&) noexcept = default;
InputFile& InputFile::operator=(InputFile&&) noexcept = default;

size_t InputFile::read(std::span<char> buffer) {
  const size_t got = state_->inflater ? state_->read_inflated(buffer.data(), buffer.size())
                                      : state_->read_plain(buffer.data(), buffer.size());
  state_->delivered_bytes += got;
  state_->check_limit(state_->delivered_bytes);
  return got;
}

size_t InputFile::read_at(uint64_t offset, std::span<char> buffer) const {
  const size_t got = State::read_fully(buffer.data(), buffer.size(), [&](char* p, size_t n, size_t done) {
    return ::pread(state_->file.descriptor.get(), p, n, static_cast<off_t>(offset + done));
  });
  state_->check_limit(offset + got);
  return got;
}

uint64_t InputFile::stored_bytes() const { return state_->file.bytes; }
bool InputFile::compressed() const { return state_->inflater != nullptr; }
bool InputFile::same_file(const InputFile& other) const {
  return state_->file.device == other.state_->file.device && state_->file.inode == other.state_->file.inode;
}

uint64_t InputFile::claimed_bytes() const {
  constexpr uint64_t kMaxInflationRatio = 1032; // maximum expansion by deflate
  std::array<unsigned char, 4> last{};
  const uint64_t stored = stored_bytes();
  if (!compressed() || stored < last.size() ||
      ::pread(state_->file.descriptor.get(), last.data(), last.size(), static_cast<off_t>(stored - last.size())) != 4)
    return 0;
  const uint64_t claimed =
      uint64_t{last[0]} | (uint64_t{last[1]} << 8) | (uint64_t{last[2]} << 16) | (uint64_t{last[3]} << 24);
  return claimed / kMaxInflationRatio <= stored ? claimed : 0;
}

std::vector<std::byte> read_whole_file(const std::filesystem::path& path, uint64_t max_bytes,
                                       MemoryReservation* memory) {
  InputFile file(path, max_bytes);
  if (file.stored_bytes() > max_bytes)
    throw Error(ErrorKind::kLimitExceeded, "file of " + std::to_string(file.stored_bytes()) +
                                               " bytes exceeds the limit of " + std::to_string(max_bytes) + " bytes");
  const auto reserve = [&](uint64_t bytes) {
    if (memory) memory->cover(bytes, "its content");
  };
  std::vector<std::byte> content;
  // One more byte than expected, so that a single read detects the end of an unchanged file.
  size_t room = static_cast<size_t>(std::min(std::max(file.stored_bytes(), file.claimed_bytes()), max_bytes)) + 1;
  size_t size = 0;
  while (true) {
    reserve(size == 0 ? room : 2 * size + room); // two copies exist while the vector grows
    content.resize(size + room);
    const size_t got = file.read({reinterpret_cast<char*>(content.data()) + size, room});
    size += got;
    if (got < room) {
      if (char none; file.compressed()) file.read({&none, 1}); // throws if the gzip data is damaged or truncated
      break;
    }
    // Reading one byte more than allowed is enough to detect an oversized file.
    room = static_cast<size_t>(std::min<uint64_t>(std::max<size_t>(size / 2, kCompressedChunk), max_bytes - size + 1));
  }
  content.resize(size);
  return content;
}

} // namespace packtrace
