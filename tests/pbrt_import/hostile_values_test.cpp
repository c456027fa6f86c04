#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

/// A trianglemesh of the unit square, followed by other parameters.
std::string square(const std::string& more) {
  return "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [0 0 0 1 0 0 1 1 0 0 1 0] " + more;
}
std::string mesh(const std::string& indices, const std::string& points = "0 0 0 1 0 0 1 1 0 0 1 0") {
  return "Shape \"trianglemesh\" \"integer indices\" [" + indices + "] \"point P\" [" + points + "]";
}

std::vector<HostileCase> meshes() {
  return {
      {"PointsNotANumber",
       world(mesh("0 1 2 0 2 3", "0 0 0 nan 0 0 1 1 0 0 1 0")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 0) dropped: vertex position not finite
)",
       {2, 2, 0, 1}},
      {"PointsInfinite",
       world(mesh("0 1 2 0 2 3", "0 0 0 inf 0 0 1 1 0 -inf 1 0")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 triangles (the first is number 0) dropped: vertex position not finite
scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no triangle is left
)",
       {1, 1, 1, 2}},
      {"PointsTooLargeForFloats",
       world(mesh("0 1 2 0 2 3", "0 0 0 1e400 0 0 1 1 0 0 1e39 0")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 triangles (the first is number 0) dropped: vertex position not finite
scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no triangle is left
)",
       {1, 1, 1, 2}},
      {"PointsTooSmallForFloats",
       world(mesh("0 1 2", "0 0 0 1e-400 0 0 0 1e-46 0")),
       R"(scene.pbrt:2:1: note: trianglemesh: 1 triangle (number 0) without area kept: two corners coincide
)",
       {2, 2, 0, 0}},
      {"AllPointsNotANumber",
       world(mesh("0 1 2", "nan nan nan nan nan nan nan nan nan")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 0) dropped: vertex position not finite
scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no triangle is left
)",
       {1, 1, 1, 1}},
      {"IndicesNegative",
       world(mesh("0 1 2 0 2 -3")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range
)",
       {2, 2, 0, 1}},
      {"IndicesOutOfRange",
       world(mesh("0 1 2 0 2 4")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range
)",
       {2, 2, 0, 1}},
      {"IndicesBeyond31Bits",
       world(mesh("0 1 2 0 2 2147483648")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range
scene.pbrt:2:51: warning: integer "2147483648" does not fit in 32 bits
)",
       {2, 2, 0, 1}},
      {"IndicesBeyond64Bits",
       world(mesh("0 1 2 0 2 99999999999999999999")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range
scene.pbrt:2:51: warning: integer "99999999999999999999" does not fit in 32 bits
)",
       {2, 2, 0, 1}},
      {"IndicesNotANumber",
       world(mesh("0 1 2 0 2 nan")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 1 triangle (number 1) dropped: vertex index out of range
scene.pbrt:2:51: warning: integer "nan" does not fit in 32 bits
)",
       {2, 2, 0, 1}},
      {"IndicesAllOutOfRange",
       world(mesh("7 8 9 -1 -2 -3")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 triangles (the first is number 0) dropped: vertex index out of range
scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no triangle is left
)",
       {1, 1, 1, 2}},
      {"IndicesNotInThrees",
       world(mesh("0 1 2 0 2")),
       R"(scene.pbrt:2:1: warning: trianglemesh: the number of indices, 5, is not a multiple of 3; the last ones are ignored
)",
       {2, 2, 0, 0}},
      {"IndicesTooFew",
       world(mesh("0 1")),
       R"(scene.pbrt:2:1: warning: trianglemesh: the number of indices, 2, is not a multiple of 3; the last ones are ignored
scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no triangle is left
)",
       {1, 1, 1, 0}},
      {"IndicesRepeated",
       world(mesh("0 1 2 2 2 3 0 0 0")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 triangles (the first is number 1) dropped: repeated vertex index
)",
       {2, 2, 0, 2}},
      {"IndicesAsFloats",
       world("Shape \"trianglemesh\" \"float indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "integer indices"
)",
       {1, 1, 1, 0}},
      {"CornersCoincide",
       world(mesh("0 1 2", "1 1 1 1 1 1 0 0 0")),
       R"(scene.pbrt:2:1: note: trianglemesh: 1 triangle (number 0) without area kept: two corners coincide
)",
       {2, 2, 0, 0}},
      {"TooFewNormals",
       world(square("\"normal N\" [0 0 1 0 0 1]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 normals for 4 vertices: ignored
)",
       {2, 3, 0, 0}},
      {"TooManyNormals",
       world(square("\"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1 0 0 1]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 5 normals for 4 vertices: ignored
)",
       {2, 3, 0, 0}},
      {"TooFewUvs",
       world(square("\"point2 uv\" [0 0 1 0]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 uvs for 4 vertices: ignored
)",
       {2, 3, 0, 0}},
      {"NormalsNotANumber",
       world(square("\"normal N\" [nan 0 1 0 0 1 0 0 1 0 0 inf]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 vertex normals (the first is number 0) zero or not finite: recomputed from the faces around
)",
       {2, 3, 0, 0}},
      {"NormalsZero",
       world(square("\"normal N\" [0 0 0 0 0 0 0 0 0 0 0 0]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 4 vertex normals (the first is number 0) zero or not finite: recomputed from the faces around
)",
       {2, 3, 0, 0}},
      {"UvsAsFloatsLeftOver",
       world(std::string(kTriangle) + "\"float uv\" [0 0 1 0 0 1 7]\n" + std::string(kTriangle) +
             "\"float st\" [0 0 1 0 0 1 7]"),
       R"(scene.pbrt:2:2: warning: trianglemesh: parameter "uv" takes values in groups of 2, found 7; the last 1 are ignored
scene.pbrt:3:2: warning: trianglemesh: parameter "st" takes values in groups of 2, found 7; the last 1 are ignored
)",
       {3, 3, 0, 0}},
      {"UvsAsPointsLeftOver",
       world(std::string(kTriangle) + "\"point2 uv\" [0 0 1 0 0 1 7]"),
       R"(scene.pbrt:2:81: warning: parameter "point2 uv" takes values in groups of 2, found 7; the last 1 are ignored
)",
       {2, 2, 0, 0}},
      {"UvOfOneFloat",
       world(std::string(kTriangle) + "\"float uv\" 7"),
       R"(scene.pbrt:2:2: warning: trianglemesh: parameter "uv" takes values in groups of 2, found 1; the last 1 are ignored
)",
       {2, 2, 0, 0}},
      {"UvsNotANumber",
       world(square("\"point2 uv\" [nan 0 1 0 1 1 0 inf]")),
       R"(scene.pbrt:2:1: warning: trianglemesh: 2 uvs (the first is number 0) not finite: set to zero
)",
       {2, 3, 0, 0}},
      {"NormalsAsVectors",
       world(square("\"vector N\" [0 0 1 0 0 1 0 0 1 0 0 1]")),
       R"(scene.pbrt:2:90: warning: parameter "vector N" is ignored: it has the wrong type or number of values here
)",
       {2, 3, 0, 0}},
      {"PointsMissing",
       world("Shape \"trianglemesh\" \"integer indices\" [0 1 2]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "point P"
)",
       {1, 1, 1, 0}},
      {"IndicesMissing",
       world("Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "integer indices"
)",
       {1, 1, 1, 0}},
      {"AlphaNotANumber",
       world(square("\"float alpha\" nan")),
       R"(scene.pbrt:2:90: error: parameter "float alpha" is not finite; its default is used
)",
       {2, 3, 0, 0}},
      {"AlphaOfTwoNumbers",
       world(square("\"float alpha\" [0 1]")),
       R"(scene.pbrt:2:90: error: parameter "float alpha" takes one number, found 2; its default is used
)",
       {2, 3, 0, 0}},
      {"AlphaTextureUndefined",
       world("Texture \"leaf\" \"float\" \"constant\" " + square("\"texture alpha\" \"leef\"")),
       R"(scene.pbrt:2:124: error: no float texture "leef" for parameter "texture alpha"; did you mean "leaf"?
)",
       {2, 3, 0, 0}},
      {"AlphaTextureOfColour",
       world("Texture \"leaf\" \"spectrum\" \"constant\" " + square("\"texture alpha\" \"leaf\"")),
       R"(scene.pbrt:2:127: error: no float texture "leaf" for parameter "texture alpha"; a texture of that name has the other value type, float or spectrum
)",
       {2, 3, 0, 0}},
      {"AlphaZeroLeavesOut",
       world(square("\"float alpha\" 0")),
       R"(scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"AlphaTextureApproximated",
       world("Texture \"holes\" \"float\" \"fbm\"\n" + square("\"texture alpha\" \"holes\"")),
       R"(scene.pbrt:2:1: note: alpha texture "holes" is not a plain image over uv; its holes are approximated
)",
       {2, 3, 0, 0}},
  };
}

std::vector<HostileCase> shapes() {
  const std::string control = "\"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0]";
  const std::string nurbs =
      "Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 "
      "\"float uknots\" [0 0 1 1] \"float vknots\" [0 0 1 1] ";
  const std::string patch = "\"point P\" [0 0 0 1 0 0 0 1 0 1 1 0] ";
  return {
      {"SphereRadiusZero",
       world("Shape \"sphere\" \"float radius\" 0"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: the sphere's radius is not positive
)",
       {1, 1, 1, 0}},
      {"SphereRadiusNotANumber",
       world("Shape \"sphere\" \"float radius\" nan"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: a parameter is not finite
)",
       {1, 1, 1, 0}},
      {"SphereRadiusInfinite",
       world("Shape \"sphere\" \"float radius\" 1e400"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: a parameter is not finite
)",
       {1, 1, 1, 0}},
      {"SphereWithoutSweep",
       world("Shape \"sphere\" \"float phimax\" 0"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: phimax leaves nothing to draw
)",
       {1, 1, 1, 0}},
      {"CylinderRadiusNegative",
       world("Shape \"cylinder\" \"float radius\" -1"),
       R"(scene.pbrt:2:1: error: Shape "cylinder" is skipped: the cylinder's radius is not positive
)",
       {1, 1, 1, 0}},
      {"CylinderWithoutHeight",
       world("Shape \"cylinder\" \"float zmin\" 1 \"float zmax\" 1"),
       R"(scene.pbrt:2:1: error: Shape "cylinder" is skipped: the cylinder has no height
)",
       {1, 1, 1, 0}},
      {"DiskRadiusNotANumber",
       world("Shape \"disk\" \"float radius\" nan"),
       R"(scene.pbrt:2:1: error: Shape "disk" is skipped: a parameter is not finite
)",
       {1, 1, 1, 0}},
      {"DiskHoleOfItsOwnSize",
       world("Shape \"disk\" \"float innerradius\" 1"),
       R"(scene.pbrt:2:1: error: Shape "disk" is skipped: the disk's inner radius is not within [0, radius)
)",
       {1, 1, 1, 0}},
      {"ConeWithoutHeight",
       world("Shape \"cone\" \"float height\" 0"),
       R"(scene.pbrt:2:1: error: Shape "cone" is skipped: the cone's height is not positive
)",
       {1, 1, 1, 0}},
      {"ParaboloidAllZero",
       world("Shape \"paraboloid\" \"float radius\" 0 \"float zmax\" 0"),
       R"(scene.pbrt:2:1: error: Shape "paraboloid" is skipped: the paraboloid's radius is not positive
)",
       {1, 1, 1, 0}},
      {"HyperboloidOfOnePoint",
       world("Shape \"hyperboloid\" \"point p1\" [0 0 0] \"point p2\" [0 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "hyperboloid" is skipped: the hyperboloid's p1 and p2 are at the same height
)",
       {1, 1, 1, 0}},
      {"LoopThirtyLevels",
       world("Shape \"loopsubdiv\" \"integer levels\" 30 " + control),
       R"(scene.pbrt:2:1: error: Shape "loopsubdiv" is skipped: 30 levels of subdivision give more than 67108864 triangles
)",
       {1, 1, 1, 0}},
      {"LoopTwoBillionLevels",
       world("Shape \"loopsubdiv\" \"integer levels\" 2147483647 " + control),
       R"(scene.pbrt:2:1: error: Shape "loopsubdiv" is skipped: 2147483647 levels of subdivision give more than 67108864 triangles
)",
       {1, 1, 1, 0}},
      {"LoopNegativeLevels",
       world("Shape \"loopsubdiv\" \"integer levels\" -1 " + control),
       R"(scene.pbrt:2:1: error: Shape "loopsubdiv" is skipped: negative "levels"
)",
       {1, 1, 1, 0}},
      {"LoopNothingLeft",
       world("Shape \"loopsubdiv\" \"integer indices\" [0 1 9] \"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: warning: loopsubdiv: 1 triangle (number 0) dropped: vertex index out of range
scene.pbrt:2:1: error: Shape "loopsubdiv" is skipped: no triangle is left
)",
       {1, 1, 1, 1}},
      {"LoopOneLeft",
       world("Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [0 1 9 0 1 2 1 1 2] "
             "\"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: warning: loopsubdiv: 1 triangle (number 0) dropped: vertex index out of range
scene.pbrt:2:1: warning: loopsubdiv: 1 triangle (number 2) dropped: repeated vertex index
)",
       {2, 5, 0, 2}},
      {"HeightfieldAbsurdCounts",
       world("Shape \"heightfield\" \"integer nu\" 2147483647 \"integer nv\" 2147483647 \"float Pz\" [0 1 2 3]"),
       R"(scene.pbrt:2:1: error: Shape "heightfield" is skipped: the heightfield has 4 heights for 2147483647 x 2147483647 samples
)",
       {1, 1, 1, 0}},
      {"HeightfieldTooFewHeights",
       world("Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 3 \"float Pz\" [0 1 2 3]"),
       R"(scene.pbrt:2:1: error: Shape "heightfield" is skipped: the heightfield has 4 heights for 2 x 3 samples
)",
       {1, 1, 1, 0}},
      {"HeightfieldNegativeCounts",
       world("Shape \"heightfield\" \"integer nu\" -2 \"integer nv\" -2 \"float Pz\" [0 1 2 3]"),
       R"(scene.pbrt:2:1: error: Shape "heightfield" is skipped: negative "nu"
)",
       {1, 1, 1, 0}},
      {"HeightfieldWithoutCounts",
       world("Shape \"heightfield\" \"float Pz\" [0 1 2 3]"),
       R"(scene.pbrt:2:1: error: Shape "heightfield" is skipped: a heightfield needs nu and nv of at least 2
)",
       {1, 1, 1, 0}},
      {"HeightfieldNotANumber",
       world("Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 nan 2 3]"),
       R"(scene.pbrt:2:1: warning: heightfield: 1 triangle (number 0) dropped: vertex position not finite
)",
       {2, 2, 0, 1}},
      {"NurbsAbsurdCounts",
       world("Shape \"nurbs\" \"integer nu\" 2147483647 \"integer nv\" 2147483647 \"integer uorder\" 2 \"integer "
             "vorder\" 2 \"point P\" [0 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the number of u knots is not that of the control points plus the order
)",
       {1, 1, 1, 0}},
      {"NurbsAbsurdOrder",
       world("Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2147483647 \"integer vorder\" 2 "
             "\"point P\" [0 0 0 1 0 0 0 1 0 1 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the order along u is not within [2, 32]
)",
       {1, 1, 1, 0}},
      {"NurbsWithoutKnots",
       world("Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 \"point P\" "
             "[0 0 0 1 0 0 0 1 0 1 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the number of u knots is not that of the control points plus the order
)",
       {1, 1, 1, 0}},
      {"NurbsWithoutPoints",
       world("Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: no control points, neither "point P" nor "float Pw"
)",
       {1, 1, 1, 0}},
      {"NurbsWeightedPointsLeftOver",
       world(nurbs + "\"float Pw\" [0 0 0 1 1 0 0 1 0 1 0 1 1 1 0 1 7]"),
       R"(scene.pbrt:2:1: warning: nurbs: parameter "Pw" takes values in groups of 4, found 17; the last 1 are ignored
)",
       {2, 3, 0, 0}},
      {"NurbsRangeNotANumber",
       world(nurbs + patch + "\"float u0\" nan\n" + nurbs + patch + "\"float v1\" nan"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the range of u is empty or leaves the knots
scene.pbrt:3:1: error: Shape "nurbs" is skipped: the range of v is empty or leaves the knots
)",
       {1, 1, 2, 0}},
      {"NurbsRangeInfinite",
       world(nurbs + patch + "\"float u0\" -inf"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the range of u is empty or leaves the knots
)",
       {1, 1, 1, 0}},
      {"NurbsRangeOfItsKnots", world(nurbs + patch + "\"float u0\" 0 \"float u1\" 1"), "", {2, 3, 0, 0}},
      {"NurbsKnotsDecrease",
       world("Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 \"float "
             "uknots\" [0 1 0 1] \"float vknots\" [0 0 1 1] \"point P\" [0 0 0 1 0 0 0 1 0 1 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "nurbs" is skipped: the u knots are not finite and in order
)",
       {1, 1, 1, 0}},
      {"CurveUnknownType",
       world("Shape \"curve\" \"string type\" \"round\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: curve: type "round" is neither flat, ribbon nor cylinder; it is drawn round
)",
       {2, 17, 0, 0}},
      {"CurveNormalsWithoutRibbon",
       world(
           "Shape \"curve\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"normal N\" [0 0 1 0 0 1]\nShape \"curve\" \"string "
           "type\" \"cylinder\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"normal N\" [0 0 nan]"),
       R"(scene.pbrt:2:1: warning: curve: normals are for ribbons only; they are ignored (2 times, first here)
)",
       {3, 33, 0, 0}},
      {"CurveNormalsOfARibbon",
       world("Shape \"curve\" \"string type\" \"ribbon\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"normal N\" [0 0 1 0 0 "
             "1]"),
       "",
       {2, 3, 0, 0}},
      {"CurveUnknownBasis",
       world("Shape \"curve\" \"string basis\" \"hermite\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: basis "hermite" is neither bezier nor bspline
)",
       {1, 1, 1, 0}},
      {"CurveOfThreePoints",
       world("Shape \"curve\" \"point P\" [0 0 0 1 0 0 2 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: 3 control points do not make curve segments of degree 3
)",
       {1, 1, 1, 0}},
      {"CurveOfNoPoints",
       world("Shape \"curve\""),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: 0 control points do not make curve segments of degree 3
)",
       {1, 1, 1, 0}},
      {"CurveDegreeSeven",
       world("Shape \"curve\" \"integer degree\" 7 \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: the curve's degree is neither 2 nor 3
)",
       {1, 1, 1, 0}},
      {"CurveNegativeWidth",
       world("Shape \"curve\" \"float width\" -1 \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: a width of the curve is negative or not finite
)",
       {1, 1, 1, 0}},
      {"CurveRibbonWithoutNormals",
       world("Shape \"curve\" \"string type\" \"ribbon\" \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: a ribbon of 1 segments needs one normal more than segments, not 0
)",
       {1, 1, 1, 0}},
      {"CurvePointNotANumber",
       world("Shape \"curve\" \"point P\" [0 0 0 nan 0 0 2 0 0 3 0 0]"),
       R"(scene.pbrt:2:1: error: Shape "curve" is skipped: a control point of the curve is not finite
)",
       {1, 1, 1, 0}},
      {"ShapeUnknown",
       world("Shape \"teapot\""),
       R"(scene.pbrt:2:1: error: Shape "teapot" is skipped: unknown shape
)",
       {1, 1, 1, 0}},
      {"ShapeMisspelled",
       world("Shape \"trianglmesh\" " + control),
       R"(scene.pbrt:2:1: error: Shape "trianglmesh" is skipped: unknown shape; did you mean "trianglemesh"?
)",
       {1, 1, 1, 0}},
      {"ShapeWithoutName",
       world("Shape \"\""),
       R"(scene.pbrt:2:1: error: Shape "" is skipped: unknown shape
)",
       {1, 1, 1, 0}},
  };
}

std::vector<HostileCase> transforms() {
  return {
      {"TranslateNotANumber",
       world("Translate nan 0 0"),
       R"(scene.pbrt:2:1: error: Translate is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"ScaleInfinite",
       world("Scale inf 1 1"),
       R"(scene.pbrt:2:1: error: Scale is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"ScaleTooLarge",
       world("Scale 1e400 1 1"),
       R"(scene.pbrt:2:1: error: Scale is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"ScaleUntilItOverflows",
       world("TransformBegin Scale 1e200 1e200 1e200 Scale 1e200 1e200 1e200\nShape \"sphere\"\nTransformEnd"),
       R"(scene.pbrt:3:1: error: the shape's transform has no inverse (a scale of 0?); the shape is skipped
)",
       {1, 1, 1, 0}},
      {"ScaleUntilItVanishes",
       world("TransformBegin Scale 1e-200 1 1 Scale 1e-200 1 1\nShape \"sphere\"\nTransformEnd"),
       R"(scene.pbrt:3:1: error: the shape's transform has no inverse (a scale of 0?); the shape is skipped
)",
       {1, 1, 1, 0}},
      {"ScaleZero",
       world("TransformBegin Scale 0 0 0\nShape \"sphere\"\nTransformEnd"),
       R"(scene.pbrt:3:1: error: the shape's transform has no inverse (a scale of 0?); the shape is skipped
)",
       {1, 1, 1, 0}},
      {"ScaleZeroForAnInstance",
       world("ObjectBegin \"o\" Shape \"disk\" ObjectEnd\nTransformBegin Scale 1 0 1\nObjectInstance "
             "\"o\"\nTransformEnd"),
       R"(scene.pbrt:4:1: error: the instance's transform has no inverse (a scale of 0?); it is skipped
scene.pbrt:2:1: warning: object "o" is never instanced: left out
)",
       {1, 1, 0, 0}},
      {"RotateAboutNothing",
       world("Rotate 30 0 0 0"),
       R"(scene.pbrt:2:1: error: Rotate is ignored: the axis has no direction
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"RotateByInfinity",
       world("Rotate inf 0 0 1"),
       R"(scene.pbrt:2:1: error: Rotate is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"LookAtItself",
       world("LookAt 1 2 3 1 2 3 0 1 0"),
       R"(scene.pbrt:2:1: error: LookAt is ignored: eye and target coincide, or up is parallel to the view
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"LookAlongUp",
       world("LookAt 0 0 0 0 1 0 0 1 0"),
       R"(scene.pbrt:2:1: error: LookAt is ignored: eye and target coincide, or up is parallel to the view
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"LookAtNotANumber",
       world("LookAt 0 0 0 nan 1 0 0 0 1"),
       R"(scene.pbrt:2:1: error: LookAt is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"TransformNotAffine",
       world("Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1]"),
       R"(scene.pbrt:2:1: error: Transform is ignored: the matrix is not affine: every fourth number must be 0, the last one 1
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"TransformNotANumber",
       world("Transform [1 0 0 0 0 nan 0 0 0 0 1 0 0 0 0 1]"),
       R"(scene.pbrt:2:1: error: Transform is ignored: a number is not finite
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"TransformSingular",
       world("TransformBegin Transform [1 0 0 0 1 0 0 0 0 0 1 0 0 0 0 1]\nShape \"sphere\"\nTransformEnd"),
       R"(scene.pbrt:3:1: error: the shape's transform has no inverse (a scale of 0?); the shape is skipped
)",
       {1, 1, 1, 0}},
      {"ConcatTransformAllZero",
       world("TransformBegin ConcatTransform [0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1]\nShape \"sphere\"\nTransformEnd"),
       R"(scene.pbrt:3:1: error: the shape's transform has no inverse (a scale of 0?); the shape is skipped
)",
       {1, 1, 1, 0}},
      {"TransformTimesNotANumber",
       "TransformTimes nan 1\n" + world(""),
       R"(scene.pbrt:1:1: error: TransformTimes is ignored: a number is not finite
)",
       {1, 1, 0, 0}},
      {"FovNotANumber",
       "Camera \"perspective\" \"float fov\" nan\n" + world(""),
       R"(scene.pbrt:1:1: error: the camera's field of view must lie between 0 and 180 degrees; 90 is used
)",
       {1, 1, 0, 0}},
      {"FovInfinite",
       "Camera \"perspective\" \"float fov\" 1e400\n" + world(""),
       R"(scene.pbrt:1:1: error: the camera's field of view must lie between 0 and 180 degrees; 90 is used
)",
       {1, 1, 0, 0}},
      {"FovZero",
       "Camera \"perspective\" \"float fov\" 0\n" + world(""),
       R"(scene.pbrt:1:1: error: the camera's field of view must lie between 0 and 180 degrees; 90 is used
)",
       {1, 1, 0, 0}},
      {"FovOfTwoNumbers",
       "Camera \"perspective\" \"float fov\" [ 30 40 ]\n" + world(""),
       R"(scene.pbrt:1:22: warning: parameter "float fov" is ignored: it has the wrong type or number of values here
)",
       {1, 1, 0, 0}},
      {"CameraMisspelled",
       "Camera \"perspectiv\"\n" + world(""),
       R"(scene.pbrt:1:1: error: unknown camera "perspectiv"; it is left out; did you mean "perspective"?
)",
       {1, 1, 0, 0}},
      {"CamerasMisspelled",
       "Camera \"Orthographic\"\nCamera \"enviroment\"\nCamera \"realistc\"\nCamera \"fisheye\"\n" + world(""),
       R"(scene.pbrt:1:1: error: unknown camera "Orthographic"; it is left out; did you mean "orthographic"?
scene.pbrt:2:1: error: unknown camera "enviroment"; it is left out; did you mean "environment"?
scene.pbrt:3:1: error: unknown camera "realistc"; it is left out; did you mean "realistic"?
scene.pbrt:4:1: error: unknown camera "fisheye"; it is left out
)",
       {1, 1, 0, 0}},
      {"CameraFlattened",
       "Scale 1 0 1 Camera \"perspective\"\n" + world(""),
       R"(scene.pbrt:1:13: error: the camera's transform has no inverse; the camera is left out
)",
       {1, 1, 0, 0}},
      {"CameraWindowNotANumber",
       "Camera \"perspective\" \"float screenwindow\" [ 0 nan 0 1 ]\n" + world(""),
       R"(scene.pbrt:1:1: error: screenwindow takes four finite numbers x0 x1 y0 y1 that span an area; it is ignored
)",
       {1, 1, 0, 0}},
      {"FilmOfNoPixels",
       "Camera \"perspective\" Film \"image\" \"integer xresolution\" 0\n" + world(""),
       R"(scene.pbrt:1:22: error: xresolution must lie between 1 and 65536; 1280 is used
)",
       {1, 1, 0, 0}},
      {"FilmOfTwoBillionPixels",
       "Camera \"perspective\" Film \"image\" \"integer xresolution\" 2147483647 \"integer yresolution\" 2147483647\n" +
           world(""),
       R"(scene.pbrt:1:22: error: xresolution must lie between 1 and 65536; 1280 is used
scene.pbrt:1:22: error: yresolution must lie between 1 and 65536; 720 is used
)",
       {1, 1, 0, 0}},
      {"FilmUnknown",
       "Film \"imag\"\n" + world(""),
       R"(scene.pbrt:1:1: error: unknown film "imag"; read as "image"
)",
       {1, 1, 0, 0}},
  };
}

std::vector<HostileCase> materials() {
  return {
      {"MaterialUnknown",
       world("Material \"velvet\""),
       R"(scene.pbrt:2:1: error: unknown material "velvet"; matte is used
)",
       {1, 1, 0, 0}},
      {"MaterialMisspelled",
       world("Material \"Matte\""),
       R"(scene.pbrt:2:1: error: unknown material "Matte"; matte is used; did you mean "matte"?
)",
       {1, 1, 0, 0}},
      {"MaterialParameterMisspelled",
       world("Material \"plastic\" \"rgb kd\" [1 0 0] \"float roughnes\" 1"),
       R"(scene.pbrt:2:20: warning: parameter "rgb kd" is not used; did you mean "Kd"?
scene.pbrt:2:37: warning: parameter "float roughnes" is not used; did you mean "roughness"?
)",
       {1, 1, 0, 0}},
      {"MaterialParameterOfAnotherKind",
       world("Material \"mirror\" \"rgb Kd\" [1 0 0]"),
       R"(scene.pbrt:2:19: warning: parameter "rgb Kd" is not used
)",
       {1, 1, 0, 0}},
      {"MaterialParameterOfWrongType",
       world("Material \"matte\" \"float Kd\" 0.5 \"string sigma\" \"10\""),
       R"(scene.pbrt:2:18: warning: parameter "float Kd" is ignored: it has the wrong type or number of values here
scene.pbrt:2:33: warning: parameter "string sigma" is ignored: it has the wrong type or number of values here
)",
       {1, 1, 0, 0}},
      {"ColourOfTwoColours",
       world("Material \"matte\" \"rgb Kd\" [1 0 0 0 1 0]"),
       R"(scene.pbrt:2:18: error: parameter "rgb Kd" does not hold one colour; its default is used
)",
       {1, 1, 0, 0}},
      {"ColourOfTwoNumbers",
       world("Material \"matte\" \"rgb Kd\" [1 0]"),
       R"(scene.pbrt:2:18: warning: parameter "rgb Kd" takes values in groups of 3, found 2; the last 2 are ignored
scene.pbrt:2:18: error: parameter "rgb Kd" does not hold one colour; its default is used
)",
       {1, 1, 0, 0}},
      {"ColourNotANumber",
       world("Material \"matte\" \"rgb Kd\" [1 nan 0]"),
       R"(scene.pbrt:2:18: error: parameter "rgb Kd" is not finite; its default is used
)",
       {1, 1, 0, 0}},
      {"ColourTooLarge",
       world("Material \"matte\" \"rgb Kd\" [1e400 0 0]"),
       R"(scene.pbrt:2:18: error: parameter "rgb Kd" is not finite; its default is used
)",
       {1, 1, 0, 0}},
      {"ColourOutsideUnitRange",
       world("Material \"matte\" \"rgb Kd\" [2 -1 0.5]"),
       R"(scene.pbrt:2:1: note: material "matte": its colour leaves [0, 1] and is clamped
)",
       {1, 1, 0, 0}},
      {"BlackbodyColderThanZero",
       world("AreaLightSource \"diffuse\" \"blackbody L\" [-5 1]"),
       R"(scene.pbrt:2:27: warning: parameter "blackbody L" has a temperature that is not above 0 kelvin: it is black
)",
       {1, 1, 0, 0}},
      {"BlackbodyNotANumber",
       world("AreaLightSource \"diffuse\" \"blackbody L\" [nan 1]"),
       R"(scene.pbrt:2:27: error: parameter "blackbody L" is not finite; its default is used
)",
       {1, 1, 0, 0}},
      {"BlackbodyOfOneNumber",
       world("AreaLightSource \"diffuse\" \"blackbody L\" [3000]"),
       R"(scene.pbrt:2:27: warning: parameter "blackbody L" takes values in groups of 2, found 1; the last 1 are ignored
scene.pbrt:2:27: error: parameter "blackbody L" does not hold one colour; its default is used
)",
       {1, 1, 0, 0}},
      {"SpectrumOddCount",
       world("Material \"matte\" \"spectrum Kd\" [400 1 500]"),
       R"(scene.pbrt:2:18: warning: parameter "spectrum Kd" takes values in groups of 2, found 3; the last 1 are ignored
scene.pbrt:2:1: note: material "matte": its colour leaves [0, 1] and is clamped
)",
       {1, 1, 0, 0}},
      {"SpectrumNotANumber",
       world("Material \"matte\" \"spectrum Kd\" [400 nan 500 1]"),
       R"(scene.pbrt:2:18: error: parameter "spectrum Kd" is not finite; its default is used
)",
       {1, 1, 0, 0}},
      {"MetalOfNegativeIndex",
       world("Material \"metal\" \"rgb eta\" [-1 -1 -1] \"rgb k\" [1e38 1e38 1e38]"),
       "",
       {1, 1, 0, 0}},
      {"MetalOfTextures",
       world("Texture \"n\" \"spectrum\" \"fbm\"\nMaterial \"metal\" \"texture eta\" \"n\"\nMaterial \"metal\" "
             "\"texture k\" "
             "\"n\" \"rgb eta\" [1 1 1]"),
       R"(scene.pbrt:3:1: note: metal: a texture for "eta" is not supported; copper's is used
scene.pbrt:4:1: note: metal: a texture for "k" is not supported; copper's is used
)",
       {1, 1, 0, 0}},
      {"MetalOfAConstantTexture",
       world("Texture \"n\" \"spectrum\" \"constant\" \"rgb value\" [1 1 1]\nMaterial \"metal\" \"texture eta\" \"n\" "
             "\"texture k\" \"n\""),
       "",
       {1, 1, 0, 0}},
      {"NamedMaterialUndefined",
       world("NamedMaterial \"gold\""),
       R"(scene.pbrt:2:1: error: no named material "gold"; the material before it stays
)",
       {1, 1, 0, 0}},
      {"NamedMaterialMisspelled",
       world("MakeNamedMaterial \"gold\" \"string type\" \"metal\"\nNamedMaterial \"Gold\""),
       R"(scene.pbrt:3:1: error: no named material "Gold"; the material before it stays; did you mean "gold"?
)",
       {1, 1, 0, 0}},
      {"NamedMaterialWithoutType",
       world("MakeNamedMaterial \"gold\" \"rgb Kd\" [1 1 0]\nNamedMaterial \"gold\""),
       R"(scene.pbrt:2:1: error: MakeNamedMaterial "gold" has no "string type"; matte is used
)",
       {1, 1, 0, 0}},
      {"NamedMaterialOfUnknownType",
       world("MakeNamedMaterial \"gold\" \"string type\" \"meta\"\nNamedMaterial \"gold\""),
       R"(scene.pbrt:2:1: error: unknown material "meta"; matte is used; did you mean "metal"?
)",
       {1, 1, 0, 0}},
      {"NamedMaterialTwice",
       world("MakeNamedMaterial \"a\" \"string type\" \"matte\"\nMakeNamedMaterial \"a\" \"string type\" "
             "\"mirror\"\nNamedMaterial \"a\""),
       R"(scene.pbrt:3:1: warning: named material "a" is defined again; what follows uses the new one
)",
       {1, 1, 0, 0}},
      {"MixOfItself",
       world("MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string namedmaterial1\" \"m\" \"string "
             "namedmaterial2\" \"m\"\nNamedMaterial \"m\""),
       R"(scene.pbrt:2:1: error: mix material: no named material "m" for "namedmaterial1"; grey matte is used
scene.pbrt:2:1: error: mix material: no named material "m" for "namedmaterial2"; grey matte is used
)",
       {1, 1, 0, 0}},
      {"MixOfNothing",
       world("Material \"mix\""),
       R"(scene.pbrt:2:1: error: mix material without a "string namedmaterial1"; grey matte is used
scene.pbrt:2:1: error: mix material without a "string namedmaterial2"; grey matte is used
)",
       {1, 1, 0, 0}},
      {"MixAmountNotANumber",
       world("MakeNamedMaterial \"a\" \"string type\" \"matte\"\nMaterial \"mix\" \"string namedmaterial1\" \"a\" "
             "\"string namedmaterial2\" \"a\" \"rgb amount\" [nan 0 0]"),
       R"(scene.pbrt:3:72: error: parameter "rgb amount" is not finite; its default is used
)",
       {1, 1, 0, 0}},
      {"AreaLightUnknown",
       world("AreaLightSource \"difuse\""),
       R"(scene.pbrt:2:1: error: unknown area light "difuse"; it is ignored; did you mean "diffuse"?
)",
       {1, 1, 0, 0}},
      {"AreaLightsMisspelled",
       world("AreaLightSource \"Area\"\nAreaLightSource \"Diffuse\"\nAreaLightSource \"spot\""),
       R"(scene.pbrt:2:1: error: unknown area light "Area"; it is ignored; did you mean "area"?
scene.pbrt:3:1: error: unknown area light "Diffuse"; it is ignored; did you mean "diffuse"?
scene.pbrt:4:1: error: unknown area light "spot"; it is ignored
)",
       {1, 1, 0, 0}},
      {"TextureOfItself",
       world("Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"t\"\nMaterial \"matte\" \"texture Kd\" \"t\""),
       R"(scene.pbrt:2:32: error: no spectrum texture "t" for parameter "texture tex1"
)",
       {1, 1, 0, 0}},
      {"TexturesInACycle",
       world("Texture \"a\" \"float\" \"scale\" \"texture tex1\" \"b\"\nTexture \"b\" \"float\" \"scale\" \"texture "
             "tex1\" \"a\""),
       R"(scene.pbrt:2:29: error: no float texture "b" for parameter "texture tex1"
)",
       {1, 1, 0, 0}},
      {"TextureUndefined",
       world("Texture \"wood\" \"spectrum\" \"constant\"\nMaterial \"matte\" \"texture Kd\" \"would\""),
       R"(scene.pbrt:3:18: error: no spectrum texture "would" for parameter "texture Kd"
)",
       {1, 1, 0, 0}},
      {"TextureOfTheOtherType",
       world("Texture \"wood\" \"float\" \"constant\"\nMaterial \"matte\" \"texture Kd\" \"wood\""),
       R"(scene.pbrt:3:18: error: no spectrum texture "wood" for parameter "texture Kd"; a texture of that name has the other value type, float or spectrum
)",
       {1, 1, 0, 0}},
      {"TextureOfUnknownClass",
       world("Texture \"t\" \"float\" \"checkboard\""),
       R"(scene.pbrt:2:1: error: unknown texture class "checkboard"; did you mean "checkerboard"?
)",
       {1, 1, 0, 0}},
      {"TextureOfUnknownType",
       world("Texture \"t\" \"spectrm\" \"constant\""),
       R"(scene.pbrt:2:1: error: unknown texture type "spectrm", neither "float" nor "spectrum"; did you mean "spectrum"?
)",
       {1, 1, 0, 0}},
      {"TextureTwice",
       world("Texture \"t\" \"float\" \"constant\"\nTexture \"t\" \"spectrum\" \"constant\"\nTexture \"t\" \"float\" "
             "\"constant\""),
       R"(scene.pbrt:4:1: warning: float texture "t" is defined again; what follows uses the new one
)",
       {1, 1, 0, 0}},
      {"TextureMappingUnknown",
       world("Texture \"t\" \"float\" \"checkerboard\" \"string mapping\" \"sperical\""),
       R"(scene.pbrt:2:1: error: unknown texture mapping "sperical"; uv is used; did you mean "spherical"?
)",
       {1, 1, 0, 0}},
      {"TextureDimensionSeven",
       world("Texture \"t\" \"float\" \"checkerboard\" \"integer dimension\" 7"),
       R"(scene.pbrt:2:1: error: 7 dimensional checkerboard is not supported; taken as 3
)",
       {1, 1, 0, 0}},
      {"TextureNotANumber",
       world("Texture \"t\" \"float\" \"constant\" \"float value\" nan\n" + square("\"texture alpha\" \"t\"")),
       R"(scene.pbrt:2:1: error: parameter "float value" is not finite; its default is used
)",
       {2, 3, 0, 0}},
      {"TextureProductOverflows",
       world("Texture \"a\" \"spectrum\" \"constant\" \"rgb value\" [1e38 1e38 1e38]\nTexture \"b\" \"spectrum\" "
             "\"scale\" \"texture tex1\" \"a\" \"texture tex2\" \"a\"\nMaterial \"matte\" \"texture Kd\" \"b\""),
       R"(scene.pbrt:4:1: error: material "matte": its colour is not finite; grey is used
)",
       {1, 1, 0, 0}},
      {"TextureNamesTwoTextures",
       world("Texture \"a\" \"spectrum\" \"constant\"\nMaterial \"matte\" \"texture Kd\" [\"a\" \"a\"]"),
       R"(scene.pbrt:3:18: error: parameter "texture Kd" takes the name of one texture
)",
       {1, 1, 0, 0}},
      {"MediumUndefined",
       world("MediumInterface \"fog\" \"\""),
       R"(scene.pbrt:2:1: error: MediumInterface: no medium "fog"
)",
       {1, 1, 0, 0}},
      {"MediumNeverUsed",
       world("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\""),
       R"(scene.pbrt:2:1: note: medium "fog" is never used
)",
       {1, 1, 0, 0}},
  };
}

// Colours of unusual materials

struct ColourCase {
  const char* text;
  Vec3 albedo;
  MaterialFlags flags;
};

void expect_colours(const std::vector<ColourCase>& cases) {
  const SceneFolder folder;
  const std::string start = "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [0.2 0.2 0.2] "
                            "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0.8 0.8 0.8] "
                            "Texture \"zero\" \"spectrum\" \"constant\" \"rgb value\" [0 0 0] "
                            "Texture \"two\" \"spectrum\" \"constant\" \"rgb value\" [2 2 2] ";
  for (const ColourCase& c : cases) {
    const Imported imported = import_world(folder, start + c.text + std::string(kTriangle));
    const Material material = only_material(imported);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(material.albedo[i], c.albedo[i], 1e-6f) << c.text;
    EXPECT_EQ(material.flags, c.flags) << c.text;
    EXPECT_EQ(imported.text(), "") << c.text;
  }
}

TEST(HostileColours, GlassThatTransmitsNothingIsOpaque) {
  expect_colours(
      {{"Material \"glass\" \"rgb Kt\" [0 0 0]", Vec3(1.0f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0 0] \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.1f, 0.2f, 0.3f), 0},
       {"Material \"glass\" \"texture Kt\" \"zero\" \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.1f, 0.2f, 0.3f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0 0] \"rgb Kr\" [0 0 0]", Vec3(0.0f), 0},
       {"Material \"glass\" \"rgb Kt\" [0 0.5 0] \"rgb Kr\" [0.1 0.2 0.3]", Vec3(0.0f, 0.5f, 0.0f), kTransmissive}});
}

TEST(HostileColours, AmountsOfMixesAreClamped) {
  const std::string mix = "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" ";
  const std::string many = mix + "\"rgb amount\" [2 -1 0.5]", two = mix + "\"texture amount\" \"two\"",
                    most = mix + "\"rgb amount\" [1e38 1e38 1e38]", negative = mix + "\"rgb amount\" [-1 -1 -1]";
  expect_colours({{many.c_str(), Vec3(0.2f, 0.8f, 0.5f), 0},
                  {two.c_str(), Vec3(0.2f), 0},
                  {most.c_str(), Vec3(0.2f), 0},
                  {negative.c_str(), Vec3(0.8f), 0}});
}

TEST(HostileColours, MetalsOfTexturesAreCopper) {
  const SceneFolder folder;
  const auto albedo = [&](const std::string& parameters) {
    return only_material(import_world(folder, "Texture \"n\" \"spectrum\" \"fbm\" Material \"metal\" " + parameters +
                                                  std::string(kTriangle)))
        .albedo;
  };
  EXPECT_EQ(albedo("\"texture eta\" \"n\" \"texture k\" \"n\""), albedo(""));
  EXPECT_EQ(albedo("\"texture eta\" \"n\" \"rgb k\" [3 3 3]"), albedo("\"rgb k\" [3 3 3]"));
}

// Equal quadrics

TEST(HostileQuadrics, EqualOnesShareAMesh) {
  const SceneFolder folder;
  const auto meshes = [&](const std::string& shapes) {
    const Imported imported = import_world(folder, shapes);
    EXPECT_EQ(imported.text(), "") << shapes;
    expect_sound(imported.scene);
    return imported.scene.meshes.size();
  };
  for (const char* const kind : {"sphere", "cylinder", "disk", "cone", "paraboloid"}) {
    const std::string shape = "Shape \"" + std::string(kind) + "\" ", two = "\"float radius\" 2 ";
    EXPECT_EQ(meshes(shape + shape + shape + "\"float radius\" 1 "), 1u) << kind;
    EXPECT_EQ(meshes(shape + "\"float phimax\" 90 " + shape + "\"float phimax\" 91 "), 2u) << kind;
    EXPECT_EQ(meshes(shape + shape + two + shape + two), kind == std::string("sphere") ? 1u : 2u) << kind;
  }
  const std::string cut = "\"float zmax\" 0.5 ";
  EXPECT_EQ(meshes("Shape \"sphere\" " + cut + "Shape \"sphere\" \"float radius\" 2 " + cut), 2u);
  EXPECT_EQ(meshes("Shape \"hyperboloid\" Shape \"hyperboloid\" Shape \"hyperboloid\" \"point p1\" [1 1 0] "), 2u);
}

TEST(HostileQuadrics, WholeSpheresAreScaledToTheirSize) {
  const SceneFolder folder;
  for (const char* const text : {"3", "1e-20", "1e18", "3 \"float zmin\" -9 \"float zmax\" 9"}) {
    const Imported imported =
        import_world(folder, "Translate 1 0 0 Shape \"sphere\" \"float radius\" " + std::string(text));
    EXPECT_EQ(imported.text(), "");
    ASSERT_EQ(imported.scene.shapes.size(), 1u) << text;
    const double radius = std::stod(text);
    const Mesh& mesh = imported.scene.meshes[0];
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(glm::length(DVec3(mesh.positions[i])), 1.0, 1e-6);
      const DVec3 centred = placed(imported.scene.shapes[0], imported.scene, i) - DVec3(1, 0, 0);
      ASSERT_NEAR(glm::length(centred), radius, 1e-6 * std::max(radius, 1.0)) << text;
    }
  }
}

const bool kRegistered = register_cases("HostileMeshes", meshes(), __FILE__) &&
                         register_cases("HostileShapes", shapes(), __FILE__) &&
                         register_cases("HostileTransforms", transforms(), __FILE__) &&
                         register_cases("HostileMaterials", materials(), __FILE__);

} // namespace
} // namespace packtrace
