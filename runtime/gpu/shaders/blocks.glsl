// Threads take the pixels of a picture in blocks of 8 x 4, so that a subgroup's rays start near each other.

// Finds the pixel of a thread. Returns false for threads whose pixel lies outside the picture.
bool pixel_of_thread(uint thread, uint width, uint height, out uvec2 p) {
  uint block = thread >> 5, in_block = thread & 31u, per_row = (width + 7u) / 8u;
  p = uvec2((block % per_row) * 8u + (in_block & 7u), (block / per_row) * 4u + (in_block >> 3));
  return p.x < width && p.y < height;
}
