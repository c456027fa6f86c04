#include "pbrt_import/mesh_files/mesh_files.h"

#include <array>
#include <optional>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/mesh_files/obj_reader.h"
#include "pbrt_import/mesh_files/stl_reader.h"

namespace packtrace {
namespace {

/// Columns of the map from the files' right-handed coordinates to the scene's left-handed ones, whose up axis is y:
/// turned, scaled, and mirrored in x.
std::array<double, 16> world_from_file(const ImportOptions& options) {
  const double s = options.mesh_scale;
  switch (options.mesh_up) {
  case UpAxis::kX:
    return {0, s, 0, 0, s, 0, 0, 0, 0, 0, s, 0, 0, 0, 0, 1};
  case UpAxis::kZ:
    return {-s, 0, 0, 0, 0, 0, -s, 0, 0, s, 0, 0, 0, 0, 0, 1};
  case UpAxis::kY:
    break;
  }
  return {-s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0, 0, 0, 1};
}

void read_ply_shape(const std::filesystem::path& file, uint32_t number, const MeshFileContext& context) {
  DirectiveFeed& feed = context.feed;
  feed.begin("Shape", {number, 0, 0}, {"plymesh"});
  feed.text("filename", std::filesystem::absolute(file).string());
  feed.send();
}

void read_mesh_file(const std::filesystem::path& file, uint32_t number, const MeshFileContext& context) {
  switch (scene_format(file)) {
  case SceneFormat::kPly:
    return read_ply_shape(file, number, context);
  case SceneFormat::kObj:
    return read_obj(file, number, context);
  case SceneFormat::kStl:
    return read_stl(file, number, context);
  case SceneFormat::kPbrt:
    break;
  }
  throw Error(ErrorKind::kUsage, "a pbrt scene is a scene by itself; only PLY, OBJ and STL files can be joined");
}

} // namespace

Place read_mesh_files(std::span<const std::filesystem::path> files, const MeshFileContext& context) {
  DirectiveFeed& feed = context.feed;
  Place place{add_source(files[0], std::nullopt, context), 0, 0};
  feed.begin("WorldBegin", place);
  feed.send();
  const std::array<double, 16> map = world_from_file(context.options);
  feed.begin("Transform", place, {}, map);
  feed.send();
  for (size_t i = 0; i < files.size(); ++i) {
    if (i > 0) place = {add_source(files[i], std::nullopt, context), 0, 0};
    feed.begin("AttributeBegin", place); // names of materials and textures end with their file
    feed.send();
    try {
      with_file(files[i], [&] { read_mesh_file(files[i], place.file, context); });
    } catch (const FileError&) {
      throw;
    } catch (const Error& error) {
      if (error.kind() == ErrorKind::kCancelled) throw;
      throw FileError(error.kind(), files[i], error.what());
    }
    feed.begin("AttributeEnd", place);
    feed.send();
  }
  feed.begin("WorldEnd", place);
  feed.send();
  return place;
}

} // namespace packtrace
