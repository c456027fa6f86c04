#include "tests/benchmarks/packing_benchmark_codecs.h"

#include <cstring>
#include <span>
#include <stdexcept>

#include <meshoptimizer.h>
#include <zstd.h>

#include "tests/benchmarks/packing_benchmark_vertex.h"

namespace packtrace {
namespace {

static_assert(sizeof(Triangle) == 3 * sizeof(uint32_t) && sizeof(Vec3) == 12 && sizeof(Vec2) == 8);

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) fail(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

void zstd_decompress(std::span<const std::byte> bytes, std::span<std::byte> out) {
  if (ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size()) != out.size()) fail("zstd: wrong size");
}

template <typename Value>
std::span<const std::byte> bytes_of(const std::vector<Value>& values) {
  return std::as_bytes(std::span(values));
}

/// Bytes stored plainly or compressed with zstd.
class Stream {
public:
  void store(std::span<const std::byte> bytes, int zstd_level) {
    compressed_ = zstd_level != 0;
    if (compressed_)
      stored_ = zstd_compress(bytes, zstd_level);
    else
      stored_.assign(bytes.begin(), bytes.end());
    plain_bytes_ = bytes.size();
  }
  size_t size() const { return stored_.size(); }
  /// The result is valid until the next call.
  std::span<const std::byte> load() {
    if (!compressed_) return stored_;
    plain_.resize(plain_bytes_);
    zstd_decompress(stored_, plain_);
    return plain_;
  }

private:
  bool compressed_ = false;
  size_t plain_bytes_ = 0;
  std::vector<std::byte> stored_, plain_;
};

class RawCodec : public PackingCodec {
public:
  std::string name() const override { return "raw float + u32 indices"; }
  bool rounds() const override { return false; }

  size_t encode(const Mesh& mesh, const PackingPrecision&) override {
    stored_ = {mesh.positions, mesh.normals, mesh.uvs, mesh.triangles};
    return bytes_of(stored_.positions).size() + bytes_of(stored_.normals).size() + bytes_of(stored_.uvs).size() +
           bytes_of(stored_.triangles).size();
  }
  void decode() override { decoded_ = stored_; }
  PackingErrors errors(const Mesh& source, const PackingPrecision&) override {
    return compare_vertices(source, decoded_, {});
  }

private:
  PlainMesh stored_, decoded_;
};

class FixedVertexCodec : public PackingCodec {
public:
  explicit FixedVertexCodec(int zstd_level) : zstd_level_(zstd_level) {}

  std::string name() const override {
    return "fixed vertices + u32 indices" + (zstd_level_ == 0 ? "" : ", zstd " + std::to_string(zstd_level_));
  }
  size_t encode(const Mesh& mesh, const PackingPrecision& precision) override {
    layout_ = pack_vertices(mesh, precision);
    vertices_.store(layout_.bytes, zstd_level_);
    triangle_count_ = mesh.triangles.size();
    indices_.store(bytes_of(mesh.triangles), zstd_level_);
    return vertices_.size() + indices_.size();
  }
  void decode() override {
    unpack_vertices(layout_, vertices_.load(), decoded_);
    decoded_.triangles.resize(triangle_count_);
    const auto indices = indices_.load();
    std::memcpy(static_cast<void*>(decoded_.triangles.data()), indices.data(), indices.size());
  }
  PackingErrors errors(const Mesh& source, const PackingPrecision&) override {
    return compare_vertices(source, decoded_, {});
  }

private:
  int zstd_level_;
  FixedVertices layout_;
  Stream vertices_, indices_;
  size_t triangle_count_ = 0;
  PlainMesh decoded_;
};

class MeshoptCodec : public PackingCodec {
public:
  explicit MeshoptCodec(int zstd_level) : zstd_level_(zstd_level) {}

  std::string name() const override { return "meshoptimizer codecs, zstd " + std::to_string(zstd_level_); }

  size_t encode(const Mesh& mesh, const PackingPrecision& precision) override {
    layout_ = pack_vertices(mesh, precision);
    triangle_count_ = mesh.triangles.size();
    std::vector<uint32_t> indices(3 * triangle_count_);
    std::memcpy(indices.data(), mesh.triangles.data(), indices.size() * sizeof(uint32_t));
    meshopt_optimizeVertexCacheStrip(indices.data(), indices.data(), indices.size(), layout_.vertex_count);
    reorder(indices);

    std::vector<unsigned char> encoded(meshopt_encodeVertexBufferBound(layout_.vertex_count, layout_.stride()));
    encoded.resize(meshopt_encodeVertexBuffer(encoded.data(), encoded.size(), layout_.bytes.data(),
                                              layout_.vertex_count, layout_.stride()));
    vertices_.store(bytes_of(encoded), zstd_level_);
    encoded.resize(meshopt_encodeIndexBufferBound(indices.size(), layout_.vertex_count));
    encoded.resize(meshopt_encodeIndexBuffer(encoded.data(), encoded.size(), indices.data(), indices.size()));
    indices_.store(bytes_of(encoded), zstd_level_);
    return vertices_.size() + indices_.size();
  }

  void decode() override {
    unpacked_.resize(layout_.vertex_count * layout_.stride());
    const auto vertices = vertices_.load();
    if (meshopt_decodeVertexBuffer(unpacked_.data(), layout_.vertex_count, layout_.stride(),
                                   reinterpret_cast<const unsigned char*>(vertices.data()), vertices.size()) != 0)
      fail("meshopt_decodeVertexBuffer failed");
    unpack_vertices(layout_, unpacked_, decoded_);
    decoded_.triangles.resize(triangle_count_);
    const auto indices = indices_.load();
    if (meshopt_decodeIndexBuffer(decoded_.triangles.data(), 3 * triangle_count_, sizeof(uint32_t),
                                  reinterpret_cast<const unsigned char*>(indices.data()), indices.size()) != 0)
      fail("meshopt_decodeIndexBuffer failed");
  }

  PackingErrors errors(const Mesh& source, const PackingPrecision&) override {
    return compare_vertices(source, decoded_, source_vertex_);
  }

private:
  /// Orders the vertices by first use in the indices and removes unused ones.
  void reorder(std::vector<uint32_t>& indices) {
    const size_t before = layout_.vertex_count;
    std::vector<uint32_t> remap(before);
    layout_.vertex_count = meshopt_optimizeVertexFetchRemap(remap.data(), indices.data(), indices.size(), before);
    std::vector<std::byte> moved(layout_.vertex_count * layout_.stride());
    meshopt_remapVertexBuffer(moved.data(), layout_.bytes.data(), before, layout_.stride(), remap.data());
    layout_.bytes = std::move(moved);
    meshopt_remapIndexBuffer(indices.data(), indices.data(), indices.size(), remap.data());
    source_vertex_.resize(layout_.vertex_count);
    for (size_t i = 0; i < before; ++i)
      if (remap[i] != ~0u) source_vertex_[remap[i]] = static_cast<uint32_t>(i);
  }

  int zstd_level_;
  FixedVertices layout_;
  Stream vertices_, indices_;
  size_t triangle_count_ = 0;
  std::vector<uint32_t> source_vertex_;
  std::vector<std::byte> unpacked_;
  PlainMesh decoded_;
};

} // namespace

std::unique_ptr<PackingCodec> raw_codec() { return std::make_unique<RawCodec>(); }
std::unique_ptr<PackingCodec> fixed_vertex_codec(int zstd_level) {
  return std::make_unique<FixedVertexCodec>(zstd_level);
}
std::unique_ptr<PackingCodec> meshopt_codec(int zstd_level) { return std::make_unique<MeshoptCodec>(zstd_level); }

} // namespace packtrace
