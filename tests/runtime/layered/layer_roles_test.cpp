// Which channels of a picture are its depth, its normals and so on.

#include "runtime/layered/layer_roles.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using Names = std::vector<std::string>;

ExrInfo info_with(const Names& channels) {
  ExrInfo info;
  info.size = {4, 4};
  for (const std::string& channel : channels) info.layers.push_back({channel, {{channel, ExrType::kHalf}}});
  return info;
}

PictureChannels find_roles(const Names& channels, const NamedLayers& named = {}, bool raw_ao = false) {
  return find_picture_channels(info_with(channels), named, raw_ao, "a.exr");
}

NamedLayers naming(LayerRole role, const std::string& name) {
  NamedLayers named;
  named[static_cast<size_t>(role)] = name;
  return named;
}

std::string message_of(const Names& channels, const NamedLayers& named = {}) {
  try {
    find_roles(channels, named);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return {};
}

const Names kOwn{"ao",       "ao_raw",   "depth",    "normal.X", "normal.Y",       "normal.Z",
                 "albedo.R", "albedo.G", "albedo.B", "instance", "hit_distance",   "motion.X",
                 "motion.Y", "shaded.R", "shaded.G", "shaded.B", "previous_depth", "variance"};

TEST(LayerRoles, OwnPicturesAreUnderstood) {
  const PictureChannels found = find_roles(kOwn);
  EXPECT_EQ(found.of(LayerRole::kAo), Names{"ao"});
  EXPECT_EQ(find_roles(kOwn, {}, true).of(LayerRole::kAo), Names{"ao_raw"});
  EXPECT_EQ(found.of(LayerRole::kDepth), Names{"depth"});
  EXPECT_EQ(found.of(LayerRole::kNormal), (Names{"normal.X", "normal.Y", "normal.Z"}));
  EXPECT_EQ(found.of(LayerRole::kMotion), (Names{"motion.X", "motion.Y"}));
  EXPECT_EQ(found.of(LayerRole::kPreviousDepth), Names{"previous_depth"});
  EXPECT_EQ(found.of(LayerRole::kAlbedo), (Names{"albedo.R", "albedo.G", "albedo.B"}));
  EXPECT_EQ(found.of(LayerRole::kId), Names{"instance"});
  EXPECT_EQ(found.of(LayerRole::kHitDistance), Names{"hit_distance"});
  EXPECT_FALSE(found.blender_motion);
}

TEST(LayerRoles, BlenderPicturesAreUnderstood) {
  const PictureChannels found =
      find_roles({"ViewLayer.AO.R", "ViewLayer.AO.G", "ViewLayer.AO.B", "ViewLayer.Combined.R", "ViewLayer.Combined.G",
                  "ViewLayer.Depth.Z", "ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z",
                  "ViewLayer.Vector.X", "ViewLayer.Vector.Y", "ViewLayer.Vector.Z", "ViewLayer.Vector.W",
                  "ViewLayer.IndexOB.X", "ViewLayer.DiffCol.R", "ViewLayer.DiffCol.G", "ViewLayer.DiffCol.B"});
  EXPECT_EQ(found.of(LayerRole::kAo), Names{"ViewLayer.AO.R"});
  EXPECT_EQ(found.of(LayerRole::kDepth), Names{"ViewLayer.Depth.Z"});
  EXPECT_EQ(found.of(LayerRole::kNormal), (Names{"ViewLayer.Normal.X", "ViewLayer.Normal.Y", "ViewLayer.Normal.Z"}));
  EXPECT_EQ(found.of(LayerRole::kMotion), (Names{"ViewLayer.Vector.X", "ViewLayer.Vector.Y"}));
  EXPECT_EQ(found.of(LayerRole::kId), Names{"ViewLayer.IndexOB.X"});
  EXPECT_TRUE(found.blender_motion);
}

TEST(LayerRoles, ColoursAreTheOcclusionOfPicturesWithoutALayerForIt) {
  const PictureChannels pbrt = find_roles({"R", "G", "B", "P.X", "P.Y", "P.Z", "dzdx", "dzdy", "N.X", "N.Y", "N.Z",
                                           "Ns.X", "Ns.Y", "Ns.Z", "Albedo.R", "Albedo.G", "Albedo.B"});
  EXPECT_EQ(pbrt.of(LayerRole::kAo), Names{"R"});
  EXPECT_EQ(pbrt.of(LayerRole::kDepth), Names{"P.Z"});
  EXPECT_EQ(pbrt.of(LayerRole::kNormal), (Names{"Ns.X", "Ns.Y", "Ns.Z"}));
  const PictureChannels arnold = find_roles({"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "AO.R", "AO.G", "AO.B"});
  EXPECT_EQ(arnold.of(LayerRole::kAo), Names{"AO.R"});
  EXPECT_EQ(arnold.of(LayerRole::kDepth), Names{"Z"});
}

TEST(LayerRoles, NamedLayersAndChannelsComeFirst) {
  const Names channels{"occ", "ao", "z2.R",  "z2.G",         "z2.B",         "nx",
                       "ny",  "nz", "depth", "Own.Normal.X", "Own.Normal.Y", "Own.Normal.Z"};
  EXPECT_EQ(find_roles(channels, naming(LayerRole::kAo, "occ")).of(LayerRole::kAo), Names{"occ"});
  EXPECT_EQ(find_roles(channels, naming(LayerRole::kDepth, "z2")).of(LayerRole::kDepth), Names{"z2.R"});
  EXPECT_EQ(find_roles(channels, naming(LayerRole::kDepth, "z2.G")).of(LayerRole::kDepth), Names{"z2.G"});
  EXPECT_EQ(find_roles(channels, naming(LayerRole::kNormal, "nx,ny,nz")).of(LayerRole::kNormal),
            (Names{"nx", "ny", "nz"}));
  EXPECT_EQ(find_roles(channels, naming(LayerRole::kNormal, "NORMAL")).of(LayerRole::kNormal).front(), "Own.Normal.X");
  EXPECT_TRUE(find_roles(kOwn, naming(LayerRole::kMotion, "none")).of(LayerRole::kMotion).empty());
}

TEST(LayerRoles, MissingLayersAreSaidWithWhatThereIs) {
  const std::string missing = message_of({"ao", "normal.X", "normal.Y", "normal.Z", "gap"});
  EXPECT_NE(missing.find("a.exr: it has no layer for depth"), std::string::npos) << missing;
  EXPECT_NE(missing.find("name it with --depth; its channels are ao, normal.X"), std::string::npos) << missing;
  const std::string wrong = message_of(kOwn, naming(LayerRole::kNormal, "depth"));
  EXPECT_NE(wrong.find("--normal depth: it has no such layer of 3 channels"), std::string::npos) << wrong;
  EXPECT_FALSE(message_of(kOwn, naming(LayerRole::kDepth, "none")).empty()) << "it is required";
  EXPECT_NE(message_of(Names(100, "x.y")).find(" and 52 more"), std::string::npos);
}

TEST(LayerRoles, SimpleNamesAreTheLastPartWithoutPunctuation) {
  EXPECT_EQ(simple_layer_name("View Layer.Ambient_Occlusion"), "ambientocclusion");
  EXPECT_EQ(simple_layer_name("Z"), "z");
  EXPECT_EQ(simple_layer_name(""), "");
}

} // namespace
} // namespace packtrace
