// Alpha masks: surface_present() and AlphaMaskView::opaque().

bool texel_opaque(uint image, int64_t x, int64_t y) {
  int64_t w = int64_t(mask_words[image]), h = int64_t(mask_words[image + 1u]);
  uint wrap = mask_words[image + 2u];
  if (wrap == 0u) { // repeat
    x -= x / w * w;
    y -= y / h * h;
    if (x < 0l) x += w;
    if (y < 0l) y += h;
  } else if (wrap == 2u) { // clamp
    x = clamp(x, 0l, w - 1l);
    y = clamp(y, 0l, h - 1l);
  } else if (x < 0l || y < 0l || x >= w || y >= h) {
    return false;
  }
  uint row_words = (uint(w) + 31u) / 32u, column = uint(x);
  return ((mask_words[image + 8u + uint(y) * row_words + (column >> 5)] >> (column & 31u)) & 1u) != 0u;
}

bool opaque(uint image, vec2 uv) {
  precise double s = double(uv.x) * double(uintBitsToFloat(mask_words[image + 4u]));
  precise double t = double(uv.y) * double(uintBitsToFloat(mask_words[image + 5u]));
  s = s + double(uintBitsToFloat(mask_words[image + 6u]));
  t = t + double(uintBitsToFloat(mask_words[image + 7u]));
  precise double x = s * double(mask_words[image]);
  precise double y = (1.0lf - t) * double(mask_words[image + 1u]);
  x = x - 0.5lf;
  y = y - 0.5lf;
  const double kLimit = 9.0e15lf;
  if (!(abs(x) < kLimit && abs(y) < kLimit)) return true;
  double left = floor(x), top = floor(y);
  int64_t x0 = int64_t(left), y0 = int64_t(top);
  int64_t x1 = x0 + (x > left ? 1l : 0l), y1 = y0 + (y > top ? 1l : 0l);
  return texel_opaque(image, x0, y0) || texel_opaque(image, x1, y0) || texel_opaque(image, x0, y1) ||
         texel_opaque(image, x1, y1);
}

vec2 vertex_uv(uint at, uint vertex) {
  return vec2(uintBitsToFloat(mask_words[at + 2u * vertex]), uintBitsToFloat(mask_words[at + 2u * vertex + 1u]));
}

// Whether the masks keep the surface at a hit.
// material_word: word of the materials of the placement
bool present(Cluster c, uvec3 vertices, vec2 weights, uint material_word, uint ray_class) {
  uint material = material_word + 2u * mask_words[c.mask + 1u];
  uint all_rays = mask_words[material], shadows = ray_class == kOcclusionClass ? mask_words[material + 1u] : 0u;
  if (all_rays == 0u && shadows == 0u) return true;
  vec2 uv = vec2(0.0);
  if (mask_words[c.mask] != 0u) {
    uint at = c.mask + 2u;
    precise float first = (1.0 - weights.x) - weights.y;
    precise vec2 a = vertex_uv(at, vertices.x) * first, b = vertex_uv(at, vertices.y) * weights.x,
                 d = vertex_uv(at, vertices.z) * weights.y, sum = (a + b) + d;
    uv = sum;
  }
  if (all_rays != 0u && !opaque(all_rays, uv)) return false;
  return shadows == 0u || opaque(shadows, uv);
}
