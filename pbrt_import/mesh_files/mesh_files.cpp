#include "pbrt_import/mesh_files/mesh_files.h"

#include <array>
#include <optional>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/gltf/gltf_reader.h"
#include "pbrt_import/mesh_files/obj_reader.h"
#include "pbrt_import/mesh_files/stl_reader.h"

namespace packtrace {
namespace {

/// The map from the files' right-handed coordinates to the scene's left-handed ones, whose up axis is y: turned,
/// scaled, and mirrored in x.
DAffine world_from_file(const ImportOptions& options) {
  const double s = options.mesh_scale;
  switch (options.mesh_up) {
  case UpAxis::kX:
    return {0, s, 0, s, 0, 0, 0, 0, s, 0, 0, 0};
  case UpAxis::kZ:
    return {-s, 0, 0, 0, 0, -s, 0, s, 0, 0, 0, 0};
  case UpAxis::kY:
    break;
  }
  return {-s, 0, 0, 0, s, 0, 0, 0, s, 0, 0, 0};
}

void read_ply_shape(const std::filesystem::path& file, const Place& place, DirectiveFeed& feed) {
  feed.begin("Shape", place, {"plymesh"});
  feed.text("filename", std::filesystem::absolute(file).string());
  feed.send();
}

} // namespace

MeshFiles::MeshFiles(std::span<const std::filesystem::path> files, const MeshFileContext& context)
    : files_(files.begin(), files.end()), context_(context), world_from_file_(world_from_file(context.options)) {
  for (const std::filesystem::path& file : files_) places_.push_back({add_source(file, std::nullopt, context_), 0, 0});
}

MeshFiles::~MeshFiles() = default;

/// Runs work on a file and adds the file's name to errors.
template <class Work>
void MeshFiles::with_name(const std::filesystem::path& file, const Work& work) {
  try {
    with_file(file, work);
  } catch (const FileError&) {
    throw;
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::kCancelled) throw;
    throw FileError(error.kind(), file, error.what());
  }
}

void MeshFiles::read_file(size_t i) {
  switch (scene_format(files_[i])) {
  case SceneFormat::kPly:
    return read_ply_shape(files_[i], places_[i], context_.feed);
  case SceneFormat::kObj:
    return read_obj(files_[i], places_[i].file, context_);
  case SceneFormat::kStl:
    return read_stl(files_[i], places_[i].file, context_);
  case SceneFormat::kGltf:
    return gltf_readers_.at(i)->add_world();
  case SceneFormat::kPbrt:
    break;
  }
  throw Error(ErrorKind::kUsage, "a pbrt scene is a scene by itself; only PLY, OBJ, STL and glTF files can be joined");
}

Place MeshFiles::read() {
  DirectiveFeed& feed = context_.feed;
  for (size_t i = 0; i < files_.size(); ++i)
    if (scene_format(files_[i]) == SceneFormat::kGltf)
      with_name(files_[i], [&] {
        gltf_readers_[i] = std::make_unique<gltf::Reader>(files_[i], places_[i].file, context_, world_from_file_);
        gltf_readers_[i]->add_cameras();
      });
  feed.begin("WorldBegin", places_.front());
  feed.send();
  feed.transform("Transform", places_.front(), world_from_file_);
  for (size_t i = 0; i < files_.size(); ++i) {
    feed.with_attributes(places_[i], [&] { // names of materials and textures end with their file
      with_name(files_[i], [&] { read_file(i); });
    });
  }
  feed.begin("WorldEnd", places_.back());
  feed.send();
  return places_.back();
}

} // namespace packtrace
