// The end of the filter: finish_row() of runtime/denoise/kernels/filter_rows_body.h. The includer declares `history` and
// `result`: planes of AO, variance and length.

// @param noisy value | precision << 16
void finish(uint i, uint noisy) {
  vec2 slow = history[i];
  float before = slow.y > 0.0 ? slow.x : result[i];
  precise float moved = float(int(noisy & 0xffffu) - int(in_ao_units(before))) * (1.0 / kAoUnits);
  result[i] = noisy >= 0x10000u ? lesser(greater(before + moved, 0.0), 1.0) : -1.0; // kInvalidAo
  result[2u * pixel_count() + i] = slow.y;
}
