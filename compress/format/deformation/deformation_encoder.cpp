#include "compress/format/deformation/deformation_encoder.h"

#include <cassert>
#include <cstring>
#include <limits>
#include <string>

#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"

namespace packtrace {

DeformationEncoder::DeformationEncoder(const baked::DeformationRecord& record, std::span<const uint32_t> clusters,
                                       std::vector<FrameVertex> stored)
    : begins_(1, 0), stored_(std::move(stored)), blocks_(clusters.size()) {
  assert(record.group_frames >= 1 && record.group_frames <= baked::kMaxGroupFrames);
  for (const uint32_t count : clusters) begins_.push_back(begins_.back() + count);
  assert(begins_.back() == stored_.size());
  out_.record = record;
  out_.record.frame_count = 0;
  out_.record.vertex_count = begins_.back();
  out_.group_begins.push_back(0);
}

void DeformationEncoder::add(std::span<const FrameVertex> vertices) {
  assert(vertices.size() == stored_.size());
  if (out_.record.frame_count == baked::kMaxFrames)
    throw Error(ErrorKind::kLimitExceeded, "a sequence has more than " + std::to_string(baked::kMaxFrames) + " frames");
  tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t c) {
    const auto part = [&](std::span<const FrameVertex> all) {
      return all.subspan(begins_[c], begins_[c + 1] - begins_[c]);
    };
    FrameReferences references{part(stored_), {}, {}};
    if (in_group_ > 0) references.previous = part(previous_);
    if (in_group_ > 1) references.older = part(older_);
    encode_frame(part(vertices), references, blocks_[c]);
  });
  std::swap(previous_, older_);
  previous_.assign(vertices.begin(), vertices.end());
  ++out_.record.frame_count;
  if (++in_group_ == out_.record.group_frames) end_group();
}

void DeformationEncoder::end_group() {
  uint64_t bytes = 0;
  for (BitWriter& block : blocks_) {
    block.align(1);
    out_.offsets.push_back(static_cast<uint32_t>(bytes));
    bytes += block.bytes().size();
    if (bytes > std::numeric_limits<uint32_t>::max())
      throw Error(ErrorKind::kLimitExceeded, "the frames of one group of a sequence take more than 4 GiB");
    out_.data.insert(out_.data.end(), block.bytes().begin(), block.bytes().end());
    block = {};
  }
  out_.offsets.push_back(static_cast<uint32_t>(bytes));
  out_.group_begins.push_back(out_.data.size());
  in_group_ = 0;
}

EncodedDeformation DeformationEncoder::finish() {
  if (in_group_ > 0) end_group();
  assert(out_.record.frame_count >= 2);
  out_.record.data_bytes = out_.data.size();
  return std::move(out_);
}

std::vector<uint8_t> write_deformations(std::span<const EncodedDeformation> animations,
                                        std::span<const baked::LevelChainRecord> chains) {
  if (animations.empty() && chains.empty()) return {};
  const uint64_t chains_at = sizeof(baked::DeformationHeader) + animations.size() * sizeof(baked::DeformationRecord);
  uint64_t at = chains_at + chains.size_bytes();
  std::vector<baked::DeformationRecord> records;
  for (const EncodedDeformation& one : animations) {
    baked::DeformationRecord record = one.record;
    record.table_offset = at;
    record.data_offset = at + one.group_begins.size() * sizeof(uint64_t) + one.offsets.size() * sizeof(uint32_t);
    at = (record.data_offset + record.data_bytes + 7) / 8 * 8;
    records.push_back(record);
  }
  std::vector<uint8_t> bytes(at + kReadSlackBytes, 0);
  const baked::DeformationHeader header{static_cast<uint32_t>(animations.size()), static_cast<uint32_t>(chains.size())};
  std::memcpy(bytes.data(), &header, sizeof header);
  if (!records.empty()) std::memcpy(bytes.data() + sizeof header, records.data(), records.size() * sizeof records[0]);
  if (!chains.empty()) std::memcpy(bytes.data() + chains_at, chains.data(), chains.size_bytes());
  for (size_t i = 0; i < records.size(); ++i) {
    const EncodedDeformation& one = animations[i];
    uint8_t* out = bytes.data() + records[i].table_offset;
    std::memcpy(out, one.group_begins.data(), one.group_begins.size() * sizeof(uint64_t));
    out += one.group_begins.size() * sizeof(uint64_t);
    std::memcpy(out, one.offsets.data(), one.offsets.size() * sizeof(uint32_t));
    if (!one.data.empty()) std::memcpy(bytes.data() + records[i].data_offset, one.data.data(), one.data.size());
  }
  return bytes;
}

} // namespace packtrace
