// What hit shaders and ray generation shaders exchange.
struct Found {
  float t;
  Best best;
  uint ray_class;
};
