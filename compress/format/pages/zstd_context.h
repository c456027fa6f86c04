#pragma once

#include <memory>
#include <new>

#include <zstd.h>

namespace packtrace {

struct FreeZstd {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};
using ZstdEncoder = std::unique_ptr<ZSTD_CCtx, FreeZstd>;
using ZstdDecoder = std::unique_ptr<ZSTD_DCtx, FreeZstd>;

/// Returns a context, never null. Throws std::bad_alloc if zstd cannot allocate it.
inline ZstdEncoder make_zstd_encoder() {
  ZstdEncoder context(ZSTD_createCCtx());
  if (!context) throw std::bad_alloc();
  return context;
}
inline ZstdDecoder make_zstd_decoder() {
  ZstdDecoder context(ZSTD_createDCtx());
  if (!context) throw std::bad_alloc();
  return context;
}

} // namespace packtrace
