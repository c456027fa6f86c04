#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "pbrt_import/scene/image_size.h"
#include "pbrt_import/scene/math.h"
#include "runtime/camera/pixel_array.h"

namespace packtrace {

namespace gpu {
class DeviceAo;
class DeviceView;
} // namespace gpu

inline constexpr uint32_t kNoInstance = ~0u;

/// Marks pixels without ambient occlusion: the camera ray missed, or the pixel was not traced this frame. NaN is never
/// used for this.
inline constexpr float kInvalidAo = -1.0f;

/// Optional channels of a G-buffer.
enum GBufferChannel : uint32_t {
  kAlbedoChannel = 1,
  kTriangleChannel = 2,
  kMaterialChannel = 4,
  kBackFaceChannel = 8,
  kAllChannels = 15,
};

/// Primary visibility of one frame. Every array has one entry per pixel, rows top to bottom; those of channels that are
/// not kept are empty.
/// Pixels whose camera ray misses hold instance kNoInstance and 0 in all other arrays. previous_z may be empty.
struct GBuffer {
  ImageSize size;
  uint32_t channels = kAllChannels;  ///< bits of GBufferChannel that are kept; set by keep_channels()
  std::vector<float> view_z;         ///< camera-space z in world units (distance for environment cameras); 0 = miss
  PixelArray<Vec3> position;         ///< world space, on the traced (decoded) surface
  PixelArray<Vec3> geometric_normal; ///< world space, unit, facing the camera
  std::vector<Vec3> normal;          ///< shading normal: world space, unit, in the geometric normal's hemisphere
  std::vector<Vec3> albedo;          ///< linear sRGB
  std::vector<uint32_t> instance;    ///< SceneSource::instances() index
  std::vector<uint32_t> triangle;    ///< index in the instance's geometry
  std::vector<uint32_t> material;    ///< SceneSource::materials() index
  std::vector<uint8_t> back_face;    ///< 1 where the camera sees the triangle's back (its winding normal points away)
  PixelArray<float> offset;          ///< ray-origin offset along the geometric normal, world units (docs/accuracy.md)
  /// Screen-space motion since the previous frame in pixels (x right, y down): this pixel's centre minus the motion is
  /// where the previous frame saw the same surface point.
  std::vector<Vec2> motion_px;
  /// view_z that the surface point had in the previous frame, 0 where the previous camera cannot project it. Empty if
  /// neither the camera nor the scene moved: the same as view_z.
  std::vector<float> previous_z;
  /// World-space length of a pixel at view z 1 (PrimaryCamera::pixel_spread()); 0 if unknown.
  float pixel_spread = 0.0f;
  std::shared_ptr<gpu::DeviceView> on_gpu; ///< memory for a GPU's hits, kept from frame to frame; else null
  /// A tracer that works on a GPU may leave position, geometric_normal and offset there. Then `points_on_gpu` is true,
  /// and these arrays are empty.
  bool points_may_stay_on_gpu = false;
  bool points_on_gpu = false;
  /// It may also leave view_z, normal, motion_px and previous_z there. Then `guides_on_gpu` is true, and these arrays
  /// have their sizes but undefined values until read_device_guides() fills them in.
  bool guides_may_stay_on_gpu = false;
  bool guides_on_gpu = false;

  /// Makes all pixels misses.
  void resize(ImageSize new_size) {
    size = new_size;
    for_each_array([&](auto& array, bool kept, auto miss) { array.assign(kept ? new_size.pixels() : 0, miss); });
    previous_z.clear();
  }
  /// Resizes all arrays that are kept to the image's pixels, for a caller that writes them all. Arrays of the right
  /// length keep their values.
  void make_room(ImageSize new_size) {
    size = new_size;
    for_each_array([&](auto& array, bool kept, auto) { array.resize(kept ? new_size.pixels() : 0); });
  }
  /// Frees the memory of the other channels. Channels that are kept anew are empty until the next make_room().
  /// @param kept bits of GBufferChannel
  void keep_channels(uint32_t kept) {
    channels = kept;
    for_each_array([]<class Array>(Array& array, bool is_kept, auto) {
      if (!is_kept) array = Array(); // frees the memory, which `= {}` would keep
    });
  }
  /// Frees position, geometric_normal and offset, from which rays start.
  void forget_points() {
    position = PixelArray<Vec3>(), geometric_normal = PixelArray<Vec3>(), offset = PixelArray<float>();
  }
  /// Marks that nothing has moved since the camera rays were traced.
  void forget_motion() {
    motion_px.assign(motion_px.size(), Vec2(0));
    previous_z.clear();
  }
  bool has_points() const { return points_on_gpu || position.size() == size.pixels(); }

private:
  /// Calls work(array, whether it is kept, value of a miss) for all arrays but previous_z.
  template <typename Work>
  void for_each_array(const Work& work) {
    const auto kept = [this](GBufferChannel channel) { return (channels & channel) != 0; };
    work(view_z, true, 0.0f), work(position, true, Vec3(0)), work(geometric_normal, true, Vec3(0));
    work(normal, true, Vec3(0)), work(instance, true, kNoInstance), work(offset, true, 0.0f);
    work(motion_px, true, Vec2(0));
    work(albedo, kept(kAlbedoChannel), Vec3(0)), work(triangle, kept(kTriangleChannel), 0u);
    work(material, kept(kMaterialChannel), 0u), work(back_face, kept(kBackFaceChannel), uint8_t{0});
  }
};

/// Ambient occlusion of one frame before denoising.
struct AoFrame {
  ImageSize size;
  std::vector<float> ao;           ///< 1 = open, 0 = fully occluded, kInvalidAo = no value
  std::vector<float> hit_distance; ///< mean hit distance of the samples, world units; a miss counts as ray_length
  float ray_length = 0.0f;         ///< the AO radius, world units; 0 if unknown
  /// A pixel's samples of successive frames are stratified (is_stratified()): their mean errs less than that of
  /// independent samples with the same variance.
  bool stratified = false;
  /// Number of samples whose mean each value of `ao` is, the least of all pixels. [1..65536]
  /// 1 if camera rays are jittered within their pixels, because values then also differ by what the rays hit.
  uint32_t samples = 1;
  /// A tracer that works on a GPU may leave the values there: then `on_gpu` has them, and `ao` and `hit_distance` have
  /// no meaning until ViewTracer::read_occlusion() fills them in.
  bool may_stay_on_gpu = false;
  std::shared_ptr<gpu::DeviceAo> on_gpu;
  /// Whether hit_distance is filled; if not, it stays empty.
  bool with_distances = true;
  /// Longest history in frames, not negative, that a pixel may keep from the frames before, as history_limits() finds
  /// it where something moved. Empty: no limits.
  std::vector<float> max_history;

  void resize(ImageSize new_size) {
    size = new_size;
    ao.assign(new_size.pixels(), kInvalidAo);
    hit_distance.assign(with_distances ? new_size.pixels() : 0, 0.0f);
    max_history.clear();
  }
};

} // namespace packtrace
