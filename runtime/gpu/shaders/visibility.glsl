// Sums over the samples of a point, for both kernels that trace nearest hits: add_samples() and VisibilityCurve of the CPU,
// with the same bits.

// Two values per point: visibility, and distance in radii. The last value is a flag: not 0 if a ray was not traced.
layout(std430, binding = 10) restrict buffer Sums { double sums[]; };

// e^x for x in [-80, 0]
float exp_of_negative(float x) {
  precise float y = x * 1.44269504;
  int whole = int(y); // rounds up
  precise float f = (y - float(whole)) * 0.693147181;
  precise float power =
      1.0 +
      f * (1.0 + f * (1.0 / 2.0 +
                      f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0 + f * (1.0 / 5040.0)))))));
  precise float result = power * intBitsToFloat((whole + 127) << 23);
  return result;
}

// x: hit distance in radii
float visibility(float x) {
  precise float square = x * x, limit = push.end * push.end;
  float x2 = limit < square ? limit : square, occlusion;
  if (push.parabola > 0.0) {
    precise float share = x2 * push.parabola, left = 1.0 - share;
    occlusion = left;
  } else {
    precise float exponent = -push.lambda * x2;
    precise float above = exp_of_negative(exponent) - push.floor_, scaled = above * push.scale;
    occlusion = scaled;
  }
  float within = occlusion < 0.0 ? 0.0 : occlusion;
  within = 1.0 < within ? 1.0 : within;
  precise float dark = push.darkening * within, k = 1.0 - dark;
  return k;
}

// Adds a sample to the sums of a point.
// t: distance of the nearest hit, ignored unless `hit`
void add_sample(uint point, bool hit, float t) {
  float k = 1.0, way = 1.0;
  if (hit) {
    precise float x = t * push.inverse_radius;
    k = visibility(x);
    way = 1.0 < x ? 1.0 : x;
  }
  precise double seen = sums[2u * point] + double(k), distance = sums[2u * point + 1u] + double(way);
  sums[2u * point] = seen;
  sums[2u * point + 1u] = distance;
}
