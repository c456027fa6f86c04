#include "runtime/commands/sequence/sequence_checkpoint.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <system_error>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {
namespace {

constexpr std::array<char, 8> kCheckpointMagic{'P', 'T', 'K', 'S', 'E', 'Q', '1', '\n'};

struct CheckpointHeader {
  std::array<char, 8> magic;
  uint64_t pictures, settings_bytes, frame_bytes;
};

} // namespace

void SequenceCheckpoint::save(const SequenceState& state) const {
  const CheckpointHeader header{kCheckpointMagic, state.pictures, settings_.size(), state.frame.size()};
  std::vector<std::byte> bytes(sizeof(header) + settings_.size() + state.frame.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  const auto settings = std::as_bytes(std::span(settings_));
  std::ranges::copy(state.frame, std::ranges::copy(settings, bytes.begin() + sizeof(header)).out);
  OutputFile output(file_, true);
  output.write(bytes);
  output.commit();
}

std::optional<SequenceState> SequenceCheckpoint::load() const {
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(file_, error);
  if (error) return std::nullopt;
  std::ifstream stream(file_, std::ios::binary);
  const auto fail = [&] {
    throw Error(ErrorKind::kInput, file_ + ": damaged; remove it to render the sequence from its start");
  };
  CheckpointHeader header{};
  if (!stream.read(reinterpret_cast<char*>(&header), sizeof(header)) || header.magic != kCheckpointMagic) fail();
  const uintmax_t rest = size - sizeof(header);
  if (header.settings_bytes > rest || header.frame_bytes != rest - header.settings_bytes) fail();
  std::string settings(header.settings_bytes, '\0');
  SequenceState state{header.pictures, std::vector<std::byte>(header.frame_bytes)};
  stream.read(settings.data(), static_cast<std::streamsize>(settings.size()));
  stream.read(reinterpret_cast<char*>(state.frame.data()), static_cast<std::streamsize>(state.frame.size()));
  if (!stream) fail();
  if (settings != settings_)
    throw Error(ErrorKind::kUsage,
                file_ +
                    ": this sequence was begun with other options or another scene; use the same, or remove the file");
  return state;
}

void SequenceCheckpoint::remove() const {
  std::error_code error;
  std::filesystem::remove(file_, error);
}

} // namespace packtrace
