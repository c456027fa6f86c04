#include <cstring>

#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

const std::string kAscii = "ply\nformat ascii 1.0\n";
const std::string kLittle = "ply\nformat binary_little_endian 1.0\n";
const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kVertices = "element vertex 4\n" + kXyz;
const std::string kFaces = "element face 2\nproperty list uchar int vertex_indices\n";
const std::string kEnd = "end_header\n";
const std::string kPoints = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
const std::string kIndices = "3 0 1 2\n3 0 2 3\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return at == text.npos ? text : text.replace(at, from.size(), to);
}

std::string ascii(const std::string& vertices, const std::string& faces, const std::string& body) {
  return kAscii + vertices + faces + kEnd + body;
}
/// The square with one replacement in its text.
std::string square(const std::string& from = "", const std::string& to = "") {
  const std::string text = ascii(kVertices, kFaces, kPoints + kIndices);
  return from.empty() ? text : replaced(text, from, to);
}

std::string floats(std::initializer_list<float> values) {
  std::string bytes;
  for (const float value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

/// The square in binary form with one replacement in its header.
std::string binary(const std::string& from = "", const std::string& to = "") {
  std::string text = kLittle + kVertices + kFaces + kEnd;
  if (!from.empty()) text = replaced(text, from, to);
  return text + floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) + "\3\0\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0\0\2\0\0\0\3\0\0\0"s;
}

HostileCase ply_case(const std::string& name, const std::string& content, const std::string& diagnostics,
                     const Kept& kept) {
  return {name, world("\n" + ply_shape("m.ply")), diagnostics, kept, {{"m.ply", content}}};
}

const Kept kLost{1, 1, 1, 0};

/// One case per header line, truncated after that line.
std::vector<HostileCase> truncated_headers() {
  const std::string whole = square();
  std::vector<HostileCase> cases;
  size_t line = 0;
  for (size_t end = whole.find('\n'); whole.substr(0, end).find(kEnd.substr(0, 10)) == whole.npos;
       end = whole.find('\n', end + 1)) {
    ++line;
    cases.push_back(ply_case(numbered("EndsBehindLine", static_cast<int>(line)), whole.substr(0, end + 1),
                             "scene.pbrt:3:1: error: plymesh \"m.ply\": line " + std::to_string(line + 1) +
                                 ": the file ends inside the header; the shape is skipped\n",
                             kLost));
    cases.push_back(ply_case(numbered("EndsInLine", static_cast<int>(line + 1)), whole.substr(0, end + 4),
                             "scene.pbrt:3:1: error: plymesh \"m.ply\": line " + std::to_string(line + 1) +
                                 ": the file ends inside the header; the shape is skipped\n",
                             kLost));
  }
  return cases;
}

std::vector<HostileCase> headers() {
  return {
      ply_case("Ascii", square(), "", {2, 3, 0, 0}),
      ply_case("Binary", binary(), "", {2, 3, 0, 0}),
      ply_case("VertexIndex", square("vertex_indices", "vertex_index"), "", {2, 3, 0, 0}),
      ply_case("CommentAndObjInfo", square("element face", "comment \xff\x01\nobj_info x\nelement face"), "",
               {2, 3, 0, 0}),
      ply_case("DoubleCoordinates", square("float x", "double x"), "", {2, 3, 0, 0}),
      ply_case("FacesBeforeVertices", ascii(kFaces, kVertices, kIndices + kPoints), "", {2, 3, 0, 0}),
      ply_case(
          "EmptyFile", "",
          R"(scene.pbrt:3:1: error: plymesh "m.ply": not a PLY file: it does not begin with 'ply'; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "NotAPly", "solid cube\n",
          R"(scene.pbrt:3:1: error: plymesh "m.ply": not a PLY file: it does not begin with 'ply'; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "PlyInCapitals", square("ply", "PLY"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": not a PLY file: it does not begin with 'ply'; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "PlyAndMore", square("ply\n", "ply me\n"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 1: not a PLY file: expected 'ply' alone; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ByteOrderMark", "\xef\xbb\xbf" + square(),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": not a PLY file: it does not begin with 'ply'; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case("FormatMissing", square("format ascii 1.0\n", ""),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 8: the header has no 'format'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("FormatUnknown", square("ascii", "binary"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 2: unknown format "binary"; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("FormatTwice", square("element vertex", "format ascii 1.0\nelement vertex"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: second 'format'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("FormatOfAnotherVersion", square("1.0", "2.0"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 2: expected 'format NAME 1.0'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("EndHeaderMissing", square("end_header\n", ""),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 9: unknown keyword "0"; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("KeywordUnknown", square("element face", "elephant face"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 7: unknown keyword "elephant"; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("VerticesMissing", ascii("", kFaces, kIndices),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": no vertices; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("FacesMissing", ascii(kVertices, "", kPoints),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": no faces; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("VerticesTwice", ascii(kVertices + kVertices, kFaces, kPoints + kPoints + kIndices),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": more than one element 'vertex'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("FacesTwice", ascii(kVertices, kFaces + kFaces, kPoints + kIndices + kIndices),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": more than one element 'face'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("NoVertices", square("vertex 4", "vertex 0"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": no vertices; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("NoFaces", square("face 2", "face 0"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": no faces; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CountNegative", square("vertex 4", "vertex -4"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: expected 'element NAME COUNT'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CountOfWords", square("vertex 4", "vertex four"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: expected 'element NAME COUNT'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CountMissing", square("vertex 4", "vertex"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: expected 'element NAME COUNT'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CountBeyond64Bits", square("vertex 4", "vertex 99999999999999999999"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: expected 'element NAME COUNT'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case(
          "TwoBillionVertices", square("vertex 4", "vertex 2000000000"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 2000000000 rows of element "vertex"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "TwoBillionBinaryVertices", binary("vertex 4", "vertex 2000000000"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 2000000000 rows of element "vertex"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "FourBillionVertices", square("vertex 4", "vertex 4294967296"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": more than 2147483647 vertices claimed: the file is damaged or too large; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "TwoBillionFaces", square("face 2", "face 2000000000"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 2000000000 rows of element "face"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "TwoBillionBinaryFaces", binary("face 2", "face 2000000000"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 2000000000 rows of element "face"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case("BillionsOfRowsOfNothing", square("element face", "element nothing 18446744073709551615\nelement face"),
               "", {2, 3, 0, 0}),
      ply_case(
          "BillionsOfRowsOfSomething",
          square("element vertex",
                 "element thing 18446744073709551615\nproperty double a\nproperty double b\nelement vertex"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 18446744073709551615 rows of element "thing"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case("PropertyBeforeElements", square("element vertex", "property float w\nelement vertex"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 3: 'property' before any 'element'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("PropertyOfUnknownType", square("float x", "half x"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 4: unknown type "half"; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("PropertyWithoutName", square("float x", "float"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": line 4: expected 'property TYPE NAME'; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CoordinateMissing", square("property float z\n", ""),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": the vertices have no x, y and z; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("CoordinateAsAList", square("float z", "list uchar float z"),
               R"(scene.pbrt:3:1: error: plymesh "m.ply": the vertices have no x, y and z; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case(
          "IndicesMissing", square("vertex_indices", "corners"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the faces have no list vertex_indices or vertex_index; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "IndicesNotAList", square("list uchar int vertex_indices", "int vertex_indices"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the faces have no list vertex_indices or vertex_index; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "OnlyFaceIndices", square("vertex_indices", "face_indices"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the faces have no list vertex_indices or vertex_index; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthOfFloatType", square("list uchar", "list float"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 8: the length of a list must have an integer type; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListWithoutItemType", square("list uchar int vertex_indices", "list uchar vertex_indices"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 8: expected 'property list TYPE TYPE NAME'; the shape is skipped
)",
          {1, 1, 1, 0}),
  };
}

std::vector<HostileCase> bodies() {
  const std::string quads = replaced(kFaces, "face 2", "face 1");
  std::string negative_length = replaced(binary(), "list uchar int", "list char int");
  negative_length[negative_length.find("end_header\n") + 11 + 48] = static_cast<char>(-3);
  std::string huge_length = kLittle + kVertices + replaced(kFaces, "uchar", "uint") + kEnd +
                            floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) + "\xf0\xff\xff\xff" + std::string(64, '\0');
  std::string not_a_number = binary();
  std::memcpy(not_a_number.data() + not_a_number.find("end_header\n") + 11, "\0\0\xc0\x7f", 4);
  std::string bad_binary_index = binary();
  bad_binary_index[bad_binary_index.size() - 1] = static_cast<char>(0x80);
  return {
      ply_case("Quad", ascii(kVertices, quads, kPoints + "4 0 1 2 3\n"), "", {2, 3, 0, 0}),
      ply_case("PolygonOfTwoCorners", ascii(kVertices, kFaces, kPoints + "2 0 1\n3 0 1 2\n"),
               R"(m.ply: warning: 1 faces have fewer than three corners: ignored
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 0}),
      ply_case("PolygonsOfNoCorners", ascii(kVertices, kFaces, kPoints + "0\n0\n"),
               R"(m.ply: warning: 2 faces have fewer than three corners: ignored
  included from scene.pbrt:3:1
scene.pbrt:3:1: error: plymesh "m.ply": no triangle is left; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case("IndexNegative", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3 0 2 -3\n"),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex index out of range
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndexOutOfRange", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3 0 2 4\n"),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex index out of range
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndexOf32Bits", bad_binary_index,
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex index out of range
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndexOfAFraction", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3 0 2 2.5\n"),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex index out of range
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndexTooLargeForAnything", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3 0 2 1e400\n"),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex index out of range
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndexRepeated", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3 2 2 3\n"),
               R"(m.ply: warning: 1 triangle (number 1) dropped: repeated vertex index
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("IndicesAllOutOfRange", ascii(kVertices, kFaces, kPoints + "3 7 8 9\n3 -1 -2 -3\n"),
               R"(m.ply: warning: 2 triangles (the first is number 0) dropped: vertex index out of range
  included from scene.pbrt:3:1
scene.pbrt:3:1: error: plymesh "m.ply": no triangle is left; the shape is skipped
)",
               {1, 1, 1, 2}),
      ply_case("CoordinateNotANumber", ascii(kVertices, kFaces, "0 0 0\n1 0 0\n1 1 0\nnan 1 0\n" + kIndices),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex position not finite
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("CoordinateInfinite", ascii(kVertices, kFaces, "0 0 0\n1 0 0\n1 1 0\n1e400 1 0\n" + kIndices),
               R"(m.ply: warning: 1 triangle (number 1) dropped: vertex position not finite
  included from scene.pbrt:3:1
)",
               {2, 2, 0, 1}),
      ply_case("CoordinateNotANumberBinary", not_a_number,
               R"(m.ply: warning: 2 triangles (the first is number 0) dropped: vertex position not finite
  included from scene.pbrt:3:1
scene.pbrt:3:1: error: plymesh "m.ply": no triangle is left; the shape is skipped
)",
               {1, 1, 1, 2}),
      ply_case(
          "CoordinateOfWords", ascii(kVertices, kFaces, "0 0 0\n1 zero 0\n1 1 0\n0 1 0\n" + kIndices),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 11: expected a number, found "zero" (in element "vertex", row 1 of 4); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "CoordinateWithADecimalComma", ascii(kVertices, kFaces, "0 0 0\n1,5 0 0\n1 1 0\n0 1 0\n" + kIndices),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 11: expected a number, found "1,5" (in element "vertex", row 1 of 4); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "CoordinateWithNulBytes", ascii(kVertices, kFaces, "0 0 0\n1 \0 0\n1 1 0\n0 1 0\n"s + kIndices),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": line 11: expected a number, found "\x00" (in element "vertex", row 1 of 4); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case("CoordinatesTooFew", ascii(kVertices, kFaces, "0 0 0\n1 0\n1 1 0\n0 1 0\n" + kIndices),
               R"(m.ply: warning: 2 faces have fewer than three corners: ignored
  included from scene.pbrt:3:1
scene.pbrt:3:1: error: plymesh "m.ply": no triangle is left; the shape is skipped
)",
               {1, 1, 1, 0}),
      ply_case(
          "BodyMissing", square(kPoints + kIndices, ""),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 4 rows of element "vertex"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "BodyEndsInTheVertices", square("1 1 0\n0 1 0\n" + kIndices, ""),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 4 rows of element "vertex"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "BodyEndsInTheFaces", square("3 0 2 3\n", "3 0"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: a list is longer than the rest of it (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "BinaryBodyMissing", binary().substr(0, binary().find("end_header\n") + 11),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: it is too short for 4 rows of element "vertex"; the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "BinaryBodyEndsInTheFaces", binary().substr(0, binary().size() - 1),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: a list is longer than the rest of it (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case("BodyWithMoreBehind", square() + "and so on", "", {2, 3, 0, 0}),
      ply_case(
          "ListLengthHuge", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n4294967280 0 2 3\n"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: a list is longer than the rest of it (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthHugeBinary", huge_length,
          R"(scene.pbrt:3:1: error: plymesh "m.ply": the file is truncated: a list is longer than the rest of it (in element "face", row 0 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthNegative", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n-3 0 2 3\n"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": a list has a length that is not a count (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthNegativeBinary", negative_length,
          R"(scene.pbrt:3:1: error: plymesh "m.ply": a list has a length that is not a count (in element "face", row 0 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthOfAFraction", ascii(kVertices, kFaces, kPoints + "3 0 1 2\n3.5 0 2 3\n"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": a list has a length that is not a count (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "ListLengthNotANumber", ascii(kVertices, kFaces, kPoints + "3 0 1 2\nnan 0 2 3\n"),
          R"(scene.pbrt:3:1: error: plymesh "m.ply": a list has a length that is not a count (in element "face", row 1 of 2); the shape is skipped
)",
          {1, 1, 1, 0}),
      ply_case(
          "NormalsZero",
          ascii(kVertices + "property float nx\nproperty float ny\nproperty float nz\n", kFaces,
                "0 0 0 0 0 0\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 nan 0 0\n" + kIndices),
          R"(m.ply: warning: 2 vertex normals (the first is number 0) zero or not finite: recomputed from the faces around
  included from scene.pbrt:3:1
)",
          {2, 3, 0, 0}),
      ply_case("TextureCoordinatesNotANumber",
               ascii(kVertices + "property float u\nproperty float v\n", kFaces,
                     "0 0 0 nan 0\n1 0 0 1 0\n1 1 0 1 inf\n0 1 0 0 1\n" + kIndices),
               R"(m.ply: warning: 2 uvs (the first is number 0) not finite: set to zero
  included from scene.pbrt:3:1
)",
               {2, 3, 0, 0}),
      ply_case("CornersCoincide", ascii(kVertices, kFaces, "0 0 0\n0 0 0\n1 1 0\n0 1 0\n" + kIndices),
               R"(m.ply: note: 1 triangle (number 0) without area kept: two corners coincide
  included from scene.pbrt:3:1
)",
               {2, 3, 0, 0}),
  };
}

const bool kRegistered = register_cases("HostilePlyTruncatedHeaders", truncated_headers(), __FILE__) &&
                         register_cases("HostilePlyHeaders", headers(), __FILE__) &&
                         register_cases("HostilePlyBodies", bodies(), __FILE__);

} // namespace
} // namespace packtrace
