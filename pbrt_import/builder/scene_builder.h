#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/builder/file_loader.h"
#include "pbrt_import/builder/instance_residuals.h"
#include "pbrt_import/builder/mesh_queue.h"
#include "pbrt_import/builder/tracked_motions.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/language/cameras.h"
#include "pbrt_import/language/file_names.h"
#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/lights.h"
#include "pbrt_import/language/materials.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/texture_graph.h"
#include "pbrt_import/language/transforms.h"
#include "pbrt_import/text/reporter.h"

namespace packtrace {

/// Executes directives: maintains the graphics state and collects shapes, objects, instances and cameras.
class SceneBuilder {
public:
  SceneBuilder(const ImportOptions& options, FileNames& file_names, Reporter& reporter, Progress& progress);

  /// Executes a directive. May move large arrays out of its parameters.
  void handle(Directive& directive);

  /// Adds a track for TrackedMotion; returns its number. Throws MemoryError.
  uint32_t add_track(MotionTrack track);

  /// Adds the frames of a mesh; returns their number, for Directive::sequence. MeshSequence::mesh is ignored: it
  /// becomes the mesh of that shape.
  uint32_t add_sequence(MeshSequence sequence);

  /// Reads the files that the scene needs and returns the scene. Call once, after the last directive.
  /// @param end position of the end of the text
  /// Throws Error(kInput) if the text does not have the requested world; MemoryError; Error(kCancelled).
  ImportResult finish(const Place& end, Progress& progress);

private:
  enum class Phase { kOptions, kWorld, kDone };

  /// The current transform at the scene's time.
  struct Placement {
    DAffine map{1.0};
    uint32_t animation = kNotAnimated; ///< index into Scene::animations
  };
  uint32_t wanted_world() const { return options_.world.value_or(1); }
  bool reading() const { return world_ == wanted_world(); }

  bool allowed_here(const Directive& directive);
  void execute_directive(Directive& directive);
  void skip_damaged(Directive& directive);
  void record_unread_files(const Directive& directive);
  void handle_transform(const Directive& directive);
  void handle_active_transform(const Directive& directive);
  void handle_coordinate_system(const Directive& directive);
  void define_coordinate_system(std::string_view name, const TransformPair& transform);
  void handle_transform_times(const Directive& directive);
  void handle_material(const Directive& directive);
  void handle_named_material(const Directive& directive);
  void handle_medium(const Directive& directive);
  void handle_texture(const Directive& directive);
  void handle_area_light(const Directive& directive);
  void handle_light(const Directive& directive);
  void begin_world(const Directive& directive);
  void end_world(const Place& place);
  void open(BlockKind kind, const Directive& directive);
  void close(BlockKind kind, const Directive& directive);
  void begin_object(const Directive& directive);
  void add_instance(const Directive& directive);
  Placement place(const Directive& directive, std::string_view thing);
  bool check_instance(const Directive& directive, const Affine& world_from_object);

  void set_scene_time();
  void check_worlds(const Place& end);
  void report_media();
  void count_features();

  void add_shape(Directive& directive);
  bool make_mesh(Directive& directive, Shape& shape);
  bool make_ply_mesh(const Directive& directive, Shape& shape);
  LatticeStep read_lattice(const Directive& directive);
  bool make_inline_mesh(Directive& directive, Shape& shape);
  bool add_mesh(const Directive& directive, std::string_view kind, MeshJob&& job);
  bool make_or_queue(MeshQueue::Entry&& entry);
  void name_mesh(Mesh& mesh, std::string_view kind, const Place& place);
  void count_kept(const Directive& directive);
  void count_kept(uint64_t bytes);
  bool skip_shape(std::string_view kind, const Place& place, const std::string& problem);
  bool report_mesh(MeshQueue::Entry& entry);
  void take_queued_meshes();
  bool read_alpha(const Directive& directive, const TextureContext& context, MaterialUse& use);

  void report_and_drop_unused_objects();
  void drop_unusable_shapes(const std::vector<uint32_t>& material_numbers, std::vector<Shape>& shapes);

  TextureContext context(const Place& place) { return {state_, file_names_, graph_, reporter_, place}; }

  const ImportOptions& options_;
  FileNames& file_names_;
  Reporter& reporter_;
  Phase phase_ = Phase::kOptions;
  uint32_t world_ = 1; ///< number of the current world, which spans its options up to its WorldEnd
  std::optional<Place> options_after_world_;
  TransformTimes transform_times_;
  GraphicsState state_;
  NameTable coordinate_system_names_;
  std::vector<TransformPair> coordinate_systems_; ///< indexed by number in coordinate_system_names_
  TextureGraph graph_;
  MaterialLibrary materials_{graph_};
  LightCollector lights_;
  FileLoader loader_;
  Scene scene_; ///< until finish(), Shape::material is the number of a MaterialLibrary use
  ImportStatistics statistics_;
  CameraCollector cameras_{statistics_.ignored};
  std::map<std::string, Place> media_;      ///< position of the MakeNamedMedium by name
  std::map<std::string, Place> media_uses_; ///< position of the first MediumInterface by name
  NameTable object_names_;
  std::string last_name_;                 ///< name of the last instance, empty before the first
  uint32_t last_object_ = kNone;          ///< its number in object_names_
  std::vector<uint32_t> objects_by_name_; ///< index into Scene::objects, by number in object_names_
  std::vector<Place> object_places_;
  InstanceResiduals instance_residuals_; ///< for move_far_world()
  glm::mat3 sound_linear_{1.0f};         ///< the last linear part of an instance for which is_sound() held
  uint32_t current_object_ = kNone;
  uint32_t nested_objects_ = 0;  ///< rejected nested ObjectBegins whose ObjectEnd is still to come
  uint64_t ignored_blocks_ = 0;  ///< open blocks beyond the nesting limit
  uint32_t open_blocks_[3] = {}; ///< by BlockKind
  const CheckCancelledFn check_cancelled_;
  NameTable mesh_keys_;                     ///< values of MeshJob::same_as
  std::vector<uint32_t> mesh_slots_by_key_; ///< index into Scene::meshes, by number in mesh_keys_
  std::string shape_kind_;                  ///< of the last shape, as in ImportStatistics::shapes
  uint64_t* shape_count_ = nullptr;         ///< its count
  MemoryReservation mesh_memory_;           ///< for large meshes made from text, reserved one by one
  MemoryReservation kept_memory_;           ///< for all other data kept of directives, reserved in steps
  uint64_t kept_bytes_ = 0;
  LargeHeapPages heap_pages_;
  TrackedMotions tracked_;
  std::vector<MeshSequence> sequences_; ///< MeshSequence::mesh is kNone until a shape has the frames
  MeshQueue mesh_queue_;                ///< last member, so that its tasks end before other members are destroyed
};

} // namespace packtrace
