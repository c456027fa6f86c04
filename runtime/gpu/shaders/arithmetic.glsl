// Float operations that round once, as the CPU's do. Vulkan promises neither a fused fma() nor correct division; the host
// asks the device (probe.comp) and chooses.
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

// fma() and float division through doubles. Otherwise fma() is fused, and a quotient is made right by refining it.
layout(constant_id = 0) const bool kExactFloats = true;
// Whether double fma() is fused; else it is made of exact products and sums.
layout(constant_id = 1) const bool kFusedDoubles = false;

// A sum of doubles rounded to odd: floats made of it are rounded once.
double odd_sum(double p, double x) {
  precise double sum = p + x;
  precise double back = sum - p;
  precise double rest = (p - (sum - back)) + (x - back);
  if (rest == 0.0) return sum;
  uvec2 words = unpackDouble2x32(sum);
  if ((words.x & 1u) != 0u) return sum;
  uint64_t bits = (uint64_t(words.y) << 32) | uint64_t(words.x);
  bits = (rest > 0.0) == (sum > 0.0) ? bits + 1ul : bits - 1ul;
  return packDouble2x32(uvec2(uint(bits), uint(bits >> 32)));
}

float fused(float a, float b, float c) {
  if (kExactFloats) {
    precise double product = double(a) * double(b); // exact
    return float(odd_sum(product, double(c)));
  }
  return fma(a, b, c);
}

float divided(float a, float b) {
  if (kExactFloats) {
    precise double quotient = double(a) / double(b);
    return float(quotient);
  }
  precise float y = 1.0 / b;
  precise float error = fma(-b, y, 1.0);
  y = fma(error, y, y);
  precise float q = a * y;
  precise float rest = fma(-b, q, a);
  q = fma(rest, y, q);
  return q;
}

// The square root of a number that is not negative.
float rooted(float x) {
  if (!(x > 0.0)) return 0.0;
  if (kExactFloats) {
    precise double root = sqrt(double(x));
    return float(root);
  }
  precise float r = inversesqrt(x);
  precise float g = x * r, h = 0.5 * r;
  precise float error = fma(-h, g, 0.5);
  g = fma(g, error, g);
  h = fma(h, error, h);
  precise float rest = fma(-g, g, x);
  g = fma(rest, h, g);
  return g;
}

// a b - cd with cd = c d already rounded, plus the rounding error of cd: the difference of two products with its sign.
double double_difference(double a, double b, double c, double d) {
  precise double cd = c * d;
  if (kFusedDoubles) {
    precise double fused_part = fma(a, b, -cd), rest = fma(-c, d, cd);
    precise double sum = fused_part + rest;
    return sum;
  }
  // Source: Dekker, "A floating-point technique for extending the available precision" (1971).
  const double kSplit = 134217729.0lf;
  precise double ta = kSplit * a, tb = kSplit * b, tc = kSplit * c, td = kSplit * d;
  precise double ah = ta - (ta - a), bh = tb - (tb - b), ch = tc - (tc - c), dh = td - (td - d);
  precise double al = a - ah, bl = b - bh, cl = c - ch, dl = d - dh;
  precise double ab = a * b;
  precise double ab_rest = ((ah * bh - ab) + ah * bl + al * bh) + al * bl;
  precise double cd_rest = ((ch * dh - cd) + ch * dl + cl * dh) + cl * dl;
  precise double difference = ab - cd;
  precise double back = difference - ab;
  precise double error = (ab - (difference - back)) + (-cd - back);
  precise double sum = difference + (error + (ab_rest - cd_rest));
  return sum;
}

// A quotient and a square root of doubles that are neither zero nor extreme, with the last bit right also where the
// device's are off by one.
double refined_quotient(double a, double b) {
  precise double q = a / b;
  if (kFusedDoubles && q != 0.0lf) {
    precise double rest = fma(-q, b, a), y = 1.0lf / b;
    q = fma(rest, y, q);
  }
  return q;
}
double refined_root(double x) {
  precise double root = sqrt(x);
  if (kFusedDoubles && x > 0.0lf) {
    precise double rest = fma(-root, root, x), half_over = 0.5lf / root;
    root = fma(rest, half_over, root);
  }
  return root;
}
