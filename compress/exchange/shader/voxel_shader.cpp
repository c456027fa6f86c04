#include "compress/exchange/shader/voxel_shader.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// Reads the stream, whose words voxels::OccupancyHeader describes.
constexpr const char* kDecoder = R"(
uint count_bits(uint v) {
  v = v - (v >> 1 & 0x55555555u);
  v = (v & 0x33333333u) + (v >> 2 & 0x33333333u);
  return (v + (v >> 4) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}

bool bit_at(int word, int bit) { return (WORDS[word + (bit >> 5)] >> (bit & 31) & 1u) != 0u; }

int field(int word, int bit, int width) {
  word += bit >> 5;
  bit &= 31;
  uint value = WORDS[word] >> bit;
  if (bit + width > 32) value |= WORDS[word + 1] << (32 - bit);
  return int(value & (1u << width) - 1u);
}

// Set bits of a level before one, counted from the nearest block of 1024.
int rank(int level, int bit) {
  int block = min(bit + 512 >> 10, GROUPS[level] - MASKS[level] - 1 >> 5), group = block >> 6;
  int word = MASKS[level] + (bit >> 5), start = MASKS[level] + block * 32;
  uint sum = group > 0 ? WORDS[GROUPS[level] + group - 1] : 0u;
  if (block > 0) sum += WORDS[BLOCKS[level] + (block - 1 >> 1)] >> 16 * (block - 1 & 1) & 0xffffu;
  for (int i = start; i < word; ++i) sum += count_bits(WORDS[i]);
  for (int i = word; i < start; ++i) sum -= count_bits(WORDS[i]);
  return int(sum + count_bits(WORDS[word] & (1u << (bit & 31)) - 1u));
}

// Whether a voxel is set. If not, shift says how large the empty cell around it is, else leaf which bit it has.
bool voxel_set(ivec3 v, out int shift, out int leaf) {
  shift = LEVELS - 1;
  int bit = ((v.z >> shift) * TOP.y + (v.y >> shift)) * TOP.x + (v.x >> shift);
  for (int level = 0; level < LEVELS - 1; ++level) {
    leaf = -1;
    if (!bit_at(MASKS[level], bit)) return HAS_FULL && bit_at(FULL[level], bit - rank(level, bit));
    int node = rank(level, bit);
    if (POINTER_BITS[level + 1] > 0) node = field(POINTERS[level + 1], node * POINTER_BITS[level + 1], POINTER_BITS[level + 1]);
    --shift;
    bit = 8 * node + (v.x >> shift & 1) + 2 * (v.y >> shift & 1) + 4 * (v.z >> shift & 1);
  }
  leaf = bit;
  return bit_at(MASKS[LEVELS - 1], bit);
}
)";

/// runtime/voxels/voxel_walk.h in GLSL.
constexpr const char* kTracer = R"(
int clamp_to(float value, int low, int high) { return value >= float(high) ? high : value > float(low) ? int(value) : low; }

float crossing(float o, float inverse, int plane) {
  EXACT float t = (float(plane) - o) * inverse;
  return t;
}

float along(float o, float t, float d) {
  EXACT float p = t * d;
  EXACT float q = o + p;
  return floor(q);
}

bool crossed(float t, int a, float t_now, int axis) { return t < t_now || (t == t_now && (axis < 0 || a <= axis)); }

// The first voxel of a ray in [0, t_max): t, voxel, its bit (or -1), and the axis of the face that the ray enters through.
bool trace(vec3 o, vec3 d, float t_max, out float t, out ivec3 v, out int leaf, out int axis) {
  vec3 inverse = 1.0 / d;
  t = 0.0;
  axis = -1;
  leaf = -1;
  v = ivec3(0);
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0.0) {
      if (!(o[a] >= 0.0 && o[a] < float(SIZE[a]))) return false;
      continue;
    }
    float near = crossing(o[a], inverse[a], d[a] > 0.0 ? 0 : SIZE[a]);
    if (near > 0.0 && near >= t) { t = near; axis = a; }
  }
  if (!(t < t_max)) return false;
  for (int a = 0; a < 3; ++a) {
    int last = SIZE[a] - 1, i = clamp_to(along(o[a], t, d[a]), 0, last);
    if (d[a] > 0.0) {
      if (crossed(crossing(o[a], inverse[a], last + 1), a, t, axis)) return false;
      while (i < last && crossed(crossing(o[a], inverse[a], i + 1), a, t, axis)) ++i;
      while (i > 0 && !crossed(crossing(o[a], inverse[a], i), a, t, axis)) --i;
    } else if (d[a] < 0.0) {
      if (crossed(crossing(o[a], inverse[a], 0), a, t, axis)) return false;
      while (i > 0 && crossed(crossing(o[a], inverse[a], i), a, t, axis)) --i;
      while (i < last && !crossed(crossing(o[a], inverse[a], i + 1), a, t, axis)) ++i;
    }
    v[a] = i;
  }
  for (int steps = 0; steps < STEPS; ++steps) {
    int shift;
    if (voxel_set(v, shift, leaf)) return true;
    int leave = -1, leave_plane = 0;
    float t_leave = 0.0;
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0.0) continue;
      int plane = (v[a] >> shift << shift) + (d[a] > 0.0 ? 1 << shift : 0);
      float t_plane = crossing(o[a], inverse[a], plane);
      if (leave < 0 || t_plane < t_leave) { t_leave = t_plane; leave = a; leave_plane = plane; }
    }
    if (!(t_leave < t_max)) return false;
    for (int a = 0; shift > 0 && a < 3; ++a) {
      if (a == leave || d[a] == 0.0) continue;
      int first = v[a], low = first >> shift << shift, high = low + (1 << shift) - 1;
      bool up = d[a] > 0.0;
      int i = clamp_to(along(o[a], t_leave, d[a]), up ? first : low, up ? high : first);
      // Planes are crossed in the order of (t, axis).
      if (up) {
        while (i < high && crossed(crossing(o[a], inverse[a], i + 1), a, t_leave, leave)) ++i;
        while (i > first && !crossed(crossing(o[a], inverse[a], i), a, t_leave, leave)) --i;
      } else {
        while (i > low && crossed(crossing(o[a], inverse[a], i), a, t_leave, leave)) --i;
        while (i < first && !crossed(crossing(o[a], inverse[a], i + 1), a, t_leave, leave)) ++i;
      }
      v[a] = i;
    }
    t = t_leave;
    axis = leave;
    v[leave] = d[leave] > 0.0 ? leave_plane : leave_plane - 1;
    if (v[leave] < 0 || v[leave] >= SIZE[leave]) return false;
  }
  return false;
}
)";

constexpr const char* kPicture = R"(
uint hash(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ x >> 16;
}

vec3 picture(vec2 pixel, vec2 resolution) {
  vec2 uv = (pixel - 0.5 * resolution) / resolution.y;
  EXACT vec3 across = uv.x * RIGHT;
  EXACT vec3 upward = uv.y * UP;
  EXACT vec3 sum = FORWARD + across;
  EXACT vec3 d = sum + upward;
  float t;
  ivec3 v;
  int leaf, axis;
  if (!trace(EYE, d, 1e30, t, v, leaf, axis)) return sqrt(BACKGROUND);
  if (axis < 0) axis = 2;
  float side = d[axis] > 0.0 ? -1.0 : 1.0;
  EXACT vec3 step = t * d;
  EXACT vec3 p = EYE + step;
  p[axis] = float(v[axis] + (side > 0.0 ? 1 : 0)) + side * 0.015625;
  uint h = hash(uint(pixel.y) * 65536u + uint(pixel.x));
  int open = 0;
  for (int i = 0; i < 16; ++i) {
    vec3 local = DIRECTIONS[i], way;
    if ((h & 1u) != 0u) local.x = -local.x;
    if ((h & 2u) != 0u) local.y = -local.y;
    if ((h & 4u) != 0u) local.xy = local.yx;
    way[axis] = side * local.z;
    way[(axis + 1) % 3] = local.x;
    way[(axis + 2) % 3] = local.y;
    float t_ao;
    ivec3 v_ao;
    int leaf_ao, axis_ao;
    if (!trace(p, way, AO_RADIUS, t_ao, v_ao, leaf_ao, axis_ao)) ++open;
  }
  return sqrt(color_of(leaf) * (float(open) / 16.0));
}
)";

float linear_of(uint32_t byte) {
  const double c = static_cast<double>(byte) / 255.0;
  return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

std::string palette_text(const Proxy& proxy, const ShaderView& view) {
  if (proxy.palette.empty()) return "vec3 color_of(int leaf) { return " + glsl_vec3(view.albedo) + "; }\n";
  const std::string count = std::to_string(proxy.palette.size());
  std::string text = "ARRAY vec3 PALETTE[" + count + "] = vec3[" + count + "](";
  for (size_t i = 0; i < proxy.palette.size(); ++i) {
    const uint32_t c = proxy.palette[i];
    text += (i > 0 ? ",\n  " : "\n  ") +
            glsl_vec3(Vec3(linear_of(c & 0xffu), linear_of(c >> 8 & 0xffu), linear_of(c >> 16 & 0xffu)));
  }
  const std::string bits = std::to_string(proxy.voxels.header().swatch_bits);
  return text + ");\nvec3 color_of(int leaf) {\n  return PALETTE[leaf < 0 ? 0 : field(" +
         std::to_string(proxy.voxels.swatch_place()) + ", rank(LEVELS - 1, leaf) * " + bits + ", " + bits + ")];\n}\n";
}

/// Arrays with an entry per level.
constexpr std::array<const char*, 6> kLevelArrays = {"MASKS", "GROUPS", "BLOCKS", "FULL", "POINTERS", "POINTER_BITS"};

std::string constants_text(const Proxy& proxy, const ShaderView& view) {
  const voxels::OccupancyHeader& h = proxy.voxels.header();
  std::array<std::vector<int32_t>, kLevelArrays.size()> places;
  for (uint32_t l = 0; l < h.levels; ++l) {
    const OccupancyStream::LevelPlace& p = proxy.voxels.place(l);
    const std::array<uint64_t, kLevelArrays.size()> of_level = {p.masks, p.groups,   p.blocks,
                                                                p.full,  p.pointers, h.level[l].pointer_bits};
    for (size_t i = 0; i < places.size(); ++i) places[i].push_back(static_cast<int32_t>(of_level[i]));
  }
  const auto ivec = [](const std::array<uint32_t, 3>& v) {
    return "ivec3(" + std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]) + ")";
  };
  std::string text = "const int LEVELS = " + std::to_string(h.levels) + ";\nconst ivec3 SIZE = " + ivec(h.size) +
                     ", TOP = " + ivec(h.top) + ";\nconst int STEPS = " +
                     std::to_string(1 + h.size[0] + h.size[1] + h.size[2]) + // each crosses a plane
                     ";\nconst bool HAS_FULL = " + ((h.flags & voxels::kHasFull) != 0 ? "true" : "false") + ";\n";
  for (size_t i = 0; i < places.size(); ++i) text += glsl_ints(kLevelArrays[i], places[i]);
  text += "const vec3 EYE = " + glsl_vec3(view.eye) + ", FORWARD = " + glsl_vec3(view.forward) +
          ",\n  RIGHT = " + glsl_vec3(view.right) + ", UP = " + glsl_vec3(view.up) +
          ",\n  BACKGROUND = " + glsl_vec3(view.background) +
          ";\nconst float AO_RADIUS = " + glsl_float(view.ao_radius) + ";\nARRAY vec3 DIRECTIONS[16] = vec3[16](";
  for (size_t i = 0; i < view.directions.size(); ++i)
    text += (i > 0 ? ",\n  " : "\n  ") + glsl_vec3(view.directions[i]);
  return text + ");\n";
}

} // namespace

ShaderView shader_view(const VoxelIndex& size, int up) {
  const DVec3 extent(size[0], size[1], size[2]);
  const auto axis = [](int a) {
    DVec3 v(0.0);
    v[a % 3] = 1.0;
    return v;
  };
  // pbrt's spaces are left-handed; the front is where the axis after the next one is large.
  const DVec3 from = glm::normalize(0.9 * axis(up + 1) + 0.4 * axis(up) + 0.55 * axis(up + 2));
  const double distance = 1.6 * glm::length(extent);
  ShaderView view;
  const DVec3 eye = 0.5 * extent + distance * from, forward = -from;
  const DVec3 right = glm::normalize(glm::cross(axis(up), forward)), upward = glm::cross(forward, right);
  constexpr double kFieldWidth = 0.68; // of the picture's height at distance 1
  view.eye = Vec3(eye), view.forward = Vec3(forward);
  view.right = Vec3(kFieldWidth * right), view.up = Vec3(kFieldWidth * upward);
  view.ao_radius = static_cast<float>(0.25 * std::max({extent.x, extent.y, extent.z}));
  for (uint32_t i = 0; i < kShaderAoRays; ++i) { // Fibonacci's lattice on the disk, lifted
    const double r = std::sqrt((i + 0.5) / kShaderAoRays), a = 2.399963229728653 * i;
    view.directions[i] = Vec3(DVec3(r * std::cos(a), r * std::sin(a), std::sqrt(1.0 - r * r)));
  }
  return view;
}

uint64_t shader_elements(const Proxy& proxy) {
  return proxy.voxels.words().size() + kLevelArrays.size() * proxy.voxels.levels() + proxy.palette.size() +
         kShaderAoRays;
}

std::string voxel_shader(const Proxy& proxy, const ShaderView& view, const ShaderConfig& config) {
  if (shader_elements(proxy) > config.max_elements)
    throw Error(ErrorKind::kLimitExceeded, "the voxels take " + std::to_string(shader_elements(proxy)) +
                                               " array elements, more than the limit of " +
                                               std::to_string(config.max_elements));
  const voxels::OccupancyHeader& h = proxy.voxels.header();
  std::string text = "// " + std::to_string(h.size[0]) + " x " + std::to_string(h.size[1]) + " x " +
                     std::to_string(h.size[2]) + " voxels in " + std::to_string(proxy.voxels.words().size()) +
                     " words. Made by packtrace export.\n";
  return glsl_begin(config.form).append(text) + glsl_words("WORDS", proxy.voxels.words()) +
         constants_text(proxy, view) + kDecoder + palette_text(proxy, view) + kTracer + kPicture +
         glsl_end(config.form);
}

} // namespace packtrace
