// The part of SceneBuilder that converts Shape directives to shapes and, at the end, assembles the Scene.
#include "pbrt_import/builder/scene_builder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>

#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/builder/outer_sides.h"
#include "pbrt_import/builder/scene_pruning.h"
#include "pbrt_import/builder/shape_builder.h"
#include "pbrt_import/language/transforms.h"
#include "pbrt_import/scene/far_world.h"
#include "pbrt_import/shapes/mesh_cleanup.h"
#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr uint64_t kMinTaskBytes = 32 * 1024; ///< of a mesh that is worth a task
constexpr uint64_t kMeshBytes = 128;          ///< for a mesh's name and the rounding of heap blocks

} // namespace

void SceneBuilder::add_shape(Directive& directive) {
  const std::string& kind = directive.names[0];
  const bool known = kind == "plymesh" || find_shape_kind(kind);
  if (!shape_count_ || shape_kind_ != (known ? kind : "unknown")) {
    shape_kind_ = known ? kind : "unknown";
    shape_count_ = &statistics_.shapes[shape_kind_];
  }
  ++*shape_count_;
  Shape shape;
  const Placement placement = place(directive, "shape");
  shape.parent_from_mesh = placement.map;
  shape.animation = placement.animation;
  shape.reverse_orientation = state_.attributes.reverse_orientation;
  if (!is_invertible(shape.parent_from_mesh)) {
    reporter_.error(directive.place, "the shape's transform has no inverse (a scale of 0?); the shape is skipped");
    ++statistics_.shapes_skipped;
    return;
  }
  const TextureContext here = context(directive.place);
  MaterialUse use;
  if (!read_alpha(directive, here, use)) {
    ++statistics_.shapes_absent;
    return;
  }
  if (!make_mesh(directive, shape)) {
    ++statistics_.shapes_skipped;
    return;
  }
  const uint32_t material =
      state_.attributes.material == kNone ? MaterialLibrary::kDefault : state_.attributes.material;
  use.recipe = materials_.with_shape_parameters(material, directive.parameters, here);
  report_unused(directive.parameters, reporter_);
  const bool in_object = current_object_ != kNone;
  if (state_.attributes.area_light != kNone && (in_object || state_.animated())) {
    reporter_.warning(directive.place, std::string("area lights ") + (in_object ? "in objects" : "on animated shapes") +
                                           " do not emit, as in pbrt");
  } else {
    use.area_light = state_.attributes.area_light;
    use.emission = state_.attributes.emission;
    statistics_.area_lights += use.area_light != kNone;
  }
  shape.material = materials_.use(use);
  if (current_object_ == kNone) reserve_one_more(scene_.shapes);
  (current_object_ == kNone ? scene_.shapes : scene_.objects[current_object_].shapes).push_back(shape);
}

/// Reads the alpha textures of a triangle mesh.
/// @return false if its alpha is constant 0, so that no ray can hit the shape
bool SceneBuilder::read_alpha(const Directive& directive, const TextureContext& context, MaterialUse& use) {
  if (directive.names[0] != "trianglemesh" && directive.names[0] != "plymesh") return true;
  const TextureParameters parameters(context, directive.parameters);
  const auto is_constant = [&](TextureGraph::Node node, bool zero) {
    const Vec3* const value = graph_.constant_value(node);
    return value && (*value == Vec3(0.0f)) == zero;
  };
  if (const auto alpha = parameters.find_float("alpha"); alpha && !is_constant(*alpha, false)) {
    if (is_constant(*alpha, true)) return false;
    use.alpha = *alpha;
  }
  if (const auto shadow = parameters.find_float("shadowalpha"); shadow && !is_constant(*shadow, false))
    use.shadow_alpha = *shadow;
  return true;
}

bool SceneBuilder::make_mesh(Directive& directive, Shape& shape) {
  return directive.names[0] == "plymesh" ? make_ply_mesh(directive, shape) : make_inline_mesh(directive, shape);
}

/// Reads "integer lattice", which exports of baked files state: mantissa and exponent of the positions' lattice.
LatticeStep SceneBuilder::read_lattice(const Directive& directive) {
  const std::span<const int32_t> values = directive.parameters.integers("lattice");
  if (values.empty()) return {};
  constexpr int32_t kMaxExponent = 900;
  if (values.size() != 2 || values[0] < 8 || values[0] > 15 || std::abs(values[1]) > kMaxExponent) {
    reporter_.error(directive.place, "\"integer lattice\" takes a mantissa of 8 to 15 and an exponent of -900 to 900; "
                                     "it is ignored");
    return {};
  }
  return {static_cast<uint32_t>(values[0]), values[1]};
}

bool SceneBuilder::make_ply_mesh(const Directive& directive, Shape& shape) {
  const Parameter* const file = directive.parameters.find("filename", {ParameterType::kString});
  if (!file || file->strings.size() != 1) {
    reporter_.error(directive.place, file ? "plymesh takes one file name, found " +
                                                std::to_string(file->strings.size()) + "; the shape is skipped"
                                          : "plymesh without a \"string filename\"; the shape is skipped");
    return false;
  }
  const std::filesystem::path path = file_names_.resolve(file->strings[0], file->place, reporter_);
  if (path.empty()) return false;
  const auto slot = static_cast<uint32_t>(scene_.meshes.size());
  shape.mesh = loader_.request_ply(path, directive.place, slot);
  const LatticeStep lattice = read_lattice(directive); // that of the file's first use counts
  if (shape.mesh == slot) scene_.meshes.emplace_back().lattice = lattice;
  return true;
}

bool SceneBuilder::make_inline_mesh(Directive& directive, Shape& shape) {
  const std::string& name = directive.names[0];
  const ShapeKind* const kind = find_shape_kind(name);
  if (!kind) return skip_shape(name, directive.place, "unknown shape" + did_you_mean(closest_shape_kind(name)));
  // Two captured pointers fit in a std::function without an allocation.
  const ReportFn report = [this, &directive](Severity severity, uint32_t, const std::string& message) {
    reporter_.report(severity, directive.place, directive.names[0] + ": " + message);
  };
  MeshJob job;
  const std::string problem = problem_of([&] { job = kind->read(directive.parameters, report); });
  if (kind->name == "trianglemesh") job.given.lattice = read_lattice(directive);
  directive.memory.release(); // large arrays have moved into the job
  if (!problem.empty()) return skip_shape(name, directive.place, problem);
  if (job.scale != 1.0) {
    shape.parent_from_mesh = compose(shape.parent_from_mesh, scaling(DVec3(job.scale)));
    if (!is_invertible(shape.parent_from_mesh))
      return skip_shape(name, directive.place, "its size leaves the range of numbers");
  }
  const std::string same_as = std::move(job.same_as);
  if (const std::optional<uint32_t> known = same_as.empty() ? std::nullopt : mesh_keys_.find(same_as)) {
    shape.mesh = mesh_slots_by_key_[*known];
    return true;
  }
  if (!add_mesh(directive, kind->name, std::move(job))) return false;
  shape.mesh = static_cast<uint32_t>(scene_.meshes.size() - 1);
  if (directive.sequence != kNoSequence) sequences_[directive.sequence].mesh = shape.mesh;
  if (!same_as.empty()) {
    mesh_keys_.intern(same_as);
    mesh_slots_by_key_.push_back(shape.mesh);
  }
  return true;
}

uint32_t SceneBuilder::add_sequence(MeshSequence sequence) {
  sequence.mesh = kNone;
  reserve_one_more(sequences_);
  sequences_.push_back(std::move(sequence));
  return static_cast<uint32_t>(sequences_.size() - 1);
}

/// Adds a mesh to the scene.
/// @return false if it could not be made
bool SceneBuilder::add_mesh(const Directive& directive, std::string_view kind, MeshJob&& job) {
  if (!job.make && job.bytes_at_most < kMinTaskBytes && is_clean(job.given)) {
    heap_pages_.about_to_allocate(job.bytes_at_most + kMeshBytes);
    kept_bytes_ += job.bytes_at_most;
    name_mesh(job.given, kind, directive.place);
    reserve_one_more(scene_.meshes);
    scene_.meshes.push_back(std::move(job.given));
    return true;
  }
  MeshQueue::Entry entry;
  entry.job = std::move(job);
  entry.kind = kind;
  entry.place = directive.place;
  entry.sequence = reporter_.sequence();
  entry.slot = static_cast<uint32_t>(scene_.meshes.size());
  return make_or_queue(std::move(entry));
}

/// Adds a mesh. Large meshes are queued and stay empty until take_queued_meshes().
/// @return false if the mesh could not be made
bool SceneBuilder::make_or_queue(MeshQueue::Entry&& entry) {
  heap_pages_.about_to_allocate(entry.job.bytes_at_most + kMeshBytes);
  const bool small = entry.job.bytes_at_most > 0 && entry.job.bytes_at_most < kMinTaskBytes;
  if (!small) {
    entry.memory = MemoryReservation(options_.memory);
    entry.memory.resize(std::max(entry.job.bytes_at_most, entry.job.bytes_at_least), "the shape");
  }
  if (entry.job.bytes_at_most >= kMinTaskBytes) {
    reserve_one_more(scene_.meshes);
    scene_.meshes.emplace_back();
    mesh_queue_.add(std::move(entry));
    return true;
  }
  entry.made = run_job(entry.job, options_.tessellation_tolerance, check_cancelled_, small ? nullptr : &entry.memory);
  if (!entry.made.memory_problem.empty()) throw MemoryError(entry.made.memory_problem);
  if (!report_mesh(entry)) return false;
  if (small) kept_bytes_ += bytes_of(entry.made.mesh);
  mesh_memory_.merge(std::move(entry.memory));
  reserve_one_more(scene_.meshes);
  scene_.meshes.push_back(std::move(entry.made.mesh));
  return true;
}

bool SceneBuilder::skip_shape(std::string_view kind, const Place& place, const std::string& problem) {
  reporter_.error(place, "Shape " + in_quotes(kind) + " is skipped: " + problem);
  return false;
}

/// Reports the problems of a mesh and names it.
/// @return false if the mesh could not be made
bool SceneBuilder::report_mesh(MeshQueue::Entry& entry) {
  for (auto& [severity, message] : entry.made.reports)
    reporter_.report(severity, entry.place, std::string(entry.kind) + ": " + message);
  scene_.dropped_triangles += entry.made.dropped_triangles;
  name_mesh(entry.made.mesh, entry.kind, entry.place);
  return entry.made.problem.empty() || skip_shape(entry.kind, entry.place, entry.made.problem);
}

void SceneBuilder::name_mesh(Mesh& mesh, std::string_view kind, const Place& place) {
  constexpr size_t kKindBytes = 32, kLineBytes = 12; // at most
  std::array<char, kKindBytes + kLineBytes> name;
  const size_t length = kind.copy(name.data(), kKindBytes);
  name[length] = ':';
  const std::to_chars_result end = std::to_chars(name.data() + length + 1, name.data() + name.size(), place.line);
  mesh.name = std::string(name.data(), end.ptr); // without spare capacity, as there may be many
}

/// Waits for the queued meshes and stores them. A mesh that could not be made stays empty.
void SceneBuilder::take_queued_meshes() {
  mesh_queue_.finish([&](MeshQueue::Entry& entry) {
    if (!entry.made.memory_problem.empty()) throw MemoryError(reporter_.locate(entry.place), entry.made.memory_problem);
    mesh_memory_.merge(std::move(entry.memory));
    reporter_.set_sequence(entry.sequence);
    if (report_mesh(entry))
      scene_.meshes[entry.slot] = std::move(entry.made.mesh);
    else
      ++statistics_.shapes_skipped;
  });
}

void SceneBuilder::drop_unusable_shapes(const std::vector<uint32_t>& material_numbers, std::vector<Shape>& shapes) {
  std::erase_if(shapes, [&](Shape& shape) {
    shape.material = material_numbers[shape.material];
    const bool absent = scene_.materials[shape.material].flags & kAbsent;
    const bool empty = scene_.meshes[shape.mesh].triangles.empty(); // its file or its parameters were unusable
    statistics_.shapes_absent += absent && !empty;
    return absent || empty;
  });
}

/// Fills in statistics that are only known once the scene is complete.
void SceneBuilder::count_features() {
  const auto count = [](const auto& things) {
    return static_cast<uint64_t>(
        std::count_if(things.begin(), things.end(), [](const auto& thing) { return thing.animation != kNotAnimated; }));
  };
  statistics_.animated_shapes = count(scene_.shapes);
  for (const Object& object : scene_.objects) statistics_.animated_shapes += count(object.shapes);
  statistics_.animated_instances = scene_.animated_instances.size() + scene_.motion.instances.size();
  statistics_.animated_cameras = count(scene_.cameras) + scene_.motion.cameras.size();
  const auto bumps = std::count_if(scene_.materials.begin(), scene_.materials.end(),
                                   [](const Material& material) { return (material.flags & kNormalMap) != 0; });
  if (bumps > 0) statistics_.ignored["bump_maps"] = static_cast<uint64_t>(bumps);
}

void SceneBuilder::report_and_drop_unused_objects() {
  uint64_t count = 0;
  uint32_t first = 0;
  std::string name; // copied before the objects are renumbered
  tracked_.renumber(drop_unused_objects(scene_, instance_residuals_, false, [&](uint32_t object) {
    if (count++ > 0) return;
    first = object;
    name = in_quotes(scene_.objects[object].name);
  }));
  if (count == 0) return;
  reporter_.warning(object_places_[first],
                    "object " + name + (count == 1 ? " is" : " and " + std::to_string(count - 1) + " more are") +
                        " never instanced: left out");
}

ImportResult SceneBuilder::finish(const Place& end, Progress& progress) {
  check_worlds(end);
  report_media();
  if (phase_ == Phase::kWorld) {
    reporter_.warning(end, "the file ends without WorldEnd");
    end_world(end);
  } else if (phase_ == Phase::kOptions) {
    reporter_.warning(end, "the file ends without WorldBegin: the scene is empty");
  }
  const uint64_t last_sequence = reporter_.sequence();
  take_queued_meshes();
  reporter_.set_sequence(last_sequence);
  // Drops unused objects first, so that files that only they need are not read.
  if (!options_.keep_unused_objects) report_and_drop_unused_objects();
  for_each_shape(scene_, [&](const Shape& shape) { loader_.require(shape.mesh); });
  materials_.require_images(options_.keep_textures);
  loader_.load(scene_.meshes, graph_.images(), progress, statistics_, scene_.dropped_triangles);
  reporter_.set_sequence(last_sequence);
  for (const ImageRequest& image : graph_.images())
    ++(image.missing ? statistics_.textures_missing : statistics_.textures_found);
  MemoryReservation texture_memory(options_.memory);
  const std::vector<uint32_t> material_numbers =
      with_place(reporter_, [&] { return end; }, [&] { return materials_.resolve(scene_, texture_memory, reporter_); });
  drop_unusable_shapes(material_numbers, scene_.shapes);
  for (Object& object : scene_.objects) drop_unusable_shapes(material_numbers, object.shapes);
  if (const uint64_t absent = statistics_.shapes_absent; absent > 0)
    reporter_.note(end, absent == 1 ? "1 shape is left out: its alpha is 0 everywhere"
                                    : std::to_string(absent) + " shapes are left out: their alpha is 0 everywhere");
  if (options_.keep_shading) {
    scene_.has_shading = true;
    lights_.finish(graph_, scene_);
    find_outer_sides(scene_);
  }
  scene_.cameras = cameras_.finish();
  statistics_.cameras_left_out = cameras_.left_out();
  tracked_.renumber(drop_unused_objects(scene_, instance_residuals_, options_.keep_unused_objects, [](uint32_t) {}));
  scene_.motion = tracked_.take(scene_.shapes.size(), cameras_.tracks());
  move_far_world(scene_, [this](size_t instance, DAffine& map) { instance_residuals_.add_to(map, instance); });
  instance_residuals_ = {};
  const std::vector<uint32_t> mesh_numbers = drop_unused_parts(scene_);
  for (MeshSequence& sequence : sequences_)
    sequence.mesh = sequence.mesh == kNone ? kDropped : mesh_numbers[sequence.mesh];
  std::erase_if(sequences_, [](const MeshSequence& sequence) { return sequence.mesh == kDropped; });
  if (scene_.cameras.size() > 1)
    reporter_.note(end,
                   std::to_string(scene_.cameras.size()) + " cameras: the last one comes first, as pbrt uses that");
  statistics_.triangles = unique_triangle_count(scene_);
  count_features();
  MemoryReservation memory = std::move(mesh_memory_);
  memory.merge(std::move(kept_memory_));
  memory.merge(loader_.take_memory());
  memory.merge(std::move(texture_memory));
  return {std::move(scene_), std::move(statistics_), file_names_.take_named(), std::move(sequences_),
          std::move(memory)};
}

} // namespace packtrace
