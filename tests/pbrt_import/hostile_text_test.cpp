#include <algorithm>
#include <clocale>
#include <ctime>
#include <locale>

#include "tests/pbrt_import/hostile_case.h"

namespace packtrace {
namespace {

using namespace std::string_literals;

std::string repeated(const std::string& text, size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

std::string with_line_ends(const std::string& text, const std::string& line_end) {
  std::string all;
  for (const char c : text) all += c == '\n' ? line_end : std::string(1, c);
  return all;
}

std::string utf16(const std::string& text, bool big_endian) {
  std::string all;
  for (const char c : text) all += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return all;
}

const std::string kTri(kTriangle);
const std::string kMistakes = world("Nonsense\n\nShape \"spere\"\n  # comment\n   Scale 1");

std::vector<HostileCase> encodings() {
  return {
      {"Utf8ByteOrderMark", "\xef\xbb\xbf" + world(""), "", {1, 1, 0, 0}},
      {"ByteOrderMarkInTheMiddle",
       world("\xef\xbb\xbf Identity"),
       R"(scene.pbrt:2:1: error: unknown directive "\xef\xbb\xbf"
)",
       {1, 1, 0, 0}},
      {"LinesEndInCrLf",
       with_line_ends(kMistakes, "\r\n"),
       R"(scene.pbrt:2:1: error: unknown directive "Nonsense"
scene.pbrt:4:1: error: Shape "spere" is skipped: unknown shape; did you mean "sphere"?
scene.pbrt:6:4: error: Scale takes 3 numbers, found 1; it is ignored
scene.pbrt:7:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 1, 0}},
      {"LinesEndInCr",
       with_line_ends(kMistakes, "\r"),
       R"(scene.pbrt:2:1: error: unknown directive "Nonsense"
scene.pbrt:4:1: error: Shape "spere" is skipped: unknown shape; did you mean "sphere"?
scene.pbrt:6:4: error: Scale takes 3 numbers, found 1; it is ignored
scene.pbrt:7:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 1, 0}},
      {"LinesEndInCrThenLfCr",
       with_line_ends(world("Nonsense"), "\n\r"),
       R"(scene.pbrt:3:1: error: unknown directive "Nonsense"
)",
       {1, 1, 0, 0}},
      {"Utf16LittleEndian",
       "\xff\xfe" + utf16(world(""), false),
       R"(scene.pbrt: the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8)",
       {},
       {},
       {},
       ErrorKind::kInput},
      {"Utf16BigEndian",
       "\xfe\xff" + utf16(world(""), true),
       R"(scene.pbrt: the file is UTF-16 text (it starts with the byte order mark U+FEFF in 16 bits); save it as UTF-8)",
       {},
       {},
       {},
       ErrorKind::kInput},
      {"Utf16WithoutMark",
       utf16("Identity\n", false),
       R"(scene.pbrt:1:1: error: unknown directive "I"
scene.pbrt:1:2: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (9 times, first here)
scene.pbrt:2:2: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"NulBetweenDirectives",
       world("Identity\n\0\nIdentity"s),
       R"(scene.pbrt:3:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8
)",
       {1, 1, 0, 0}},
      {"NulInsideAWord",
       world("Sca\0le 2 2 2"s),
       R"(scene.pbrt:2:1: error: unknown directive "Sca"
scene.pbrt:2:4: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8
)",
       {1, 1, 0, 0}},
      {"NulInsideAString",
       world("Material \"mat\0te\""s),
       R"(scene.pbrt:2:14: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8
scene.pbrt:2:14: error: expected a quoted name after Material, found a stray byte; Material is ignored
)",
       {1, 1, 0, 0}},
      {"NulInsideAnArray",
       world("Shape \"sphere\" \"float radius\" [ 2 \0 ]"s),
       R"(scene.pbrt:2:35: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8
scene.pbrt:2:35: error: expected a number or "]" in parameter "radius", found a stray byte; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"NulBehindTheEnd",
       world("") + std::string(3, '\0'),
       R"(scene.pbrt:5:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (3 times, first here)
)",
       {1, 1, 0, 0}},
      {"FfBytes",
       world("\xff\xff Identity \xff"),
       R"(scene.pbrt:2:1: error: byte 0xFF does not belong in a pbrt file (3 times, first here)
)",
       {1, 1, 0, 0}},
      {"DeleteByte",
       world("Identity \x7f"),
       R"(scene.pbrt:2:10: error: byte 0x7F does not belong in a pbrt file
)",
       {1, 1, 0, 0}},
      {"EscapeSequenceInAName",
       world("Material \"\x1b[31mred\""),
       R"(scene.pbrt:2:11: error: byte 0x1B does not belong in a pbrt file
scene.pbrt:2:11: error: expected a quoted name after Material, found a stray byte; Material is ignored
)",
       {1, 1, 0, 0}},
      {"Latin1IsTakenAsItIs",
       world("MakeNamedMaterial \"caf\xe9\" \"string type\" \"mirror\" NamedMaterial \"caf\xe9\""),
       "",
       {1, 1, 0, 0}},
      {"Latin1UpToItsLastLettersIsText",
       world("MakeNamedMaterial \"gr\xfcn\" \"string type\" \"mirror\" NamedMaterial \"gr\xfcn\"\n"
             "MakeNamedMaterial \"\xf8\xf9\xfa\xfb\xfd\xfe\" \"string type\" \"mirror\" # \xf8\xff\n"
             "NamedMaterial \"\xf8\xf9\xfa\xfb\xfd\xfe\""),
       "",
       {1, 1, 0, 0}},
      {"LettersOfTheLastByteAreText", // y with diaeresis in Latin-1, ya in Windows-1251
       world("MakeNamedMaterial \"\xff\" \"string type\" \"mirror\"\nNamedMaterial \"\xff\"\nNamedMaterial \"\xfe\""),
       R"(scene.pbrt:4:1: error: no named material "\xfe"; the material before it stays
)",
       {1, 1, 0, 0}},
      {"Latin1IsShownInHexadecimal",
       world("MakeNamedMaterial \"gr\xfcn\" \"string type\" \"mirror\"\nNamedMaterial \"Gr\xfcn\"\n"
             "NamedMaterial \"\xc4rger\"\n\xfc"
             "ber"),
       R"(scene.pbrt:3:1: error: no named material "Gr\xfcn"; the material before it stays; did you mean "gr\xfcn"?
scene.pbrt:4:1: error: no named material "\xc4rger"; the material before it stays
scene.pbrt:5:1: error: unknown directive "\xfcber"
)",
       {1, 1, 0, 0}},
      {"Utf8IsShownAsItIs",
       world("NamedMaterial \"gr\xc3\xbcn\"\nNamedMaterial \"\xe6\x9c\xa8\"\nNamedMaterial \"\xf0\x9f\x8c\xb2\""),
       "scene.pbrt:2:1: error: no named material \"gr\xc3\xbcn\"; the material before it stays\n"
       "scene.pbrt:3:1: error: no named material \"\xe6\x9c\xa8\"; the material before it stays\n"
       "scene.pbrt:4:1: error: no named material \"\xf0\x9f\x8c\xb2\"; the material before it stays\n",
       {1, 1, 0, 0}},
      {"DamagedUtf8IsShownInHexadecimal",
       world("NamedMaterial \"\xc3\"\nNamedMaterial \"\xe6\x9c\"\nNamedMaterial \"\x9f\x8c\xb2!\"\n"
             "NamedMaterial \"\xf5\x80\x80\x80\"\nNamedMaterial \"\xc0\xaf\""),
       R"(scene.pbrt:2:1: error: no named material "\xc3"; the material before it stays
scene.pbrt:3:1: error: no named material "\xe6\x9c"; the material before it stays
scene.pbrt:4:1: error: no named material "\x9f\x8c\xb2!"; the material before it stays
scene.pbrt:5:1: error: no named material "\xf5\x80\x80\x80"; the material before it stays
scene.pbrt:6:1: error: no named material "\xc0\xaf"; the material before it stays
)",
       {1, 1, 0, 0}},
      {"ByteOrderMarkInAName",
       world("MakeNamedMaterial \"gold\" \"string type\" \"metal\"\nNamedMaterial \"\xef\xbb\xbfgold\""),
       R"(scene.pbrt:3:1: error: no named material "\xef\xbb\xbfgold"; the material before it stays
)",
       {1, 1, 0, 0}},
      {"FormFeedIsNoSpace",
       world("Scale\f2 2 2"),
       R"(scene.pbrt:2:1: error: unknown directive "Scale\x0c2"; did you mean "Scale"?
)",
       {1, 1, 0, 0}},
      {"EmptyFile",
       "",
       R"(scene.pbrt:1:1: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"OnlyAByteOrderMark",
       "\xef\xbb\xbf",
       R"(scene.pbrt:1:1: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"OnlyAComment",
       "# nothing",
       R"(scene.pbrt:1:10: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"OnlySpaces",
       std::string(100'000, ' '),
       R"(scene.pbrt:1:100001: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"PngInsteadOfText",
       "\x89PNG\r\n\x1a\n\0\0\0\rIHDR"s,
       R"(scene.pbrt:1:1: error: unknown directive "\x89PNG"
scene.pbrt:2:1: error: byte 0x1A does not belong in a pbrt file
scene.pbrt:3:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (3 times, first here)
scene.pbrt:4:1: error: unknown directive "IHDR"
scene.pbrt:4:5: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"ElfInsteadOfText",
       "\x7f"s + "ELF\2\1\1\0\0\0\0\0\0\0\0\0"s,
       R"(scene.pbrt:1:1: error: byte 0x7F does not belong in a pbrt file
scene.pbrt:1:5: error: byte 0x02 does not belong in a pbrt file
scene.pbrt:1:6: error: byte 0x01 does not belong in a pbrt file (2 times, first here)
scene.pbrt:1:8: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as UTF-8 (9 times, first here)
scene.pbrt:1:17: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
  };
}

std::vector<HostileCase> tokens() {
  return {
      {"StringOpenInADirectivesName",
       world("Shape \"sphere"),
       R"(scene.pbrt:2:7: error: string without its closing quote: "sphere"; Shape is ignored
)",
       {1, 1, 1, 0}},
      {"StringOpenInADeclaration",
       world("Shape \"sphere\" \"float radius 2"),
       R"(scene.pbrt:2:16: error: string without its closing quote: "float radius 2"; it is ignored
)",
       {2, 9801, 0, 0}},
      {"StringOpenInAValue",
       world("Material \"matte\" \"string x\" \"abc"),
       R"(scene.pbrt:2:29: error: string without its closing quote: "abc"; the parameter is ignored
)",
       {1, 1, 0, 0}},
      {"StringOpenInAnArray",
       world("Shape \"plymesh\" \"string filename\" [ \"a.ply ]"),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
scene.pbrt:2:37: error: string without its closing quote: "a.ply ]"; the parameter is ignored
)",
       {1, 1, 1, 0}},
      {"StringOpenAtTheEndOfTheFile",
       "WorldBegin" + kTri + "Material \"",
       R"(scene.pbrt:1:100: error: string without its closing quote: ""; Material is ignored
scene.pbrt:1:101: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"StringOpenInInclude",
       world("Include \"a.pbrt"),
       R"(scene.pbrt:2:9: error: string without its closing quote: "a.pbrt"; Include is ignored
)",
       {1, 1, 0, 0}},
      {"StringOpenInTexturesThirdName",
       world("Texture \"a\" \"float\" \"constant"),
       R"(scene.pbrt:2:21: error: string without its closing quote: "constant"; Texture is ignored
)",
       {1, 1, 0, 0}},
      {"StringWithALineEndInside",
       world("Material \"mat\nte\""),
       R"(scene.pbrt:2:10: error: string without its closing quote: "mat"; Material is ignored
scene.pbrt:3:1: error: unknown directive "te"
)",
       {1, 1, 0, 0}},
      {"StringEndsInABackslash",
       world("Material \"matte\\\"\nIdentity"),
       R"(scene.pbrt:2:10: error: string without its closing quote: "matte\""; Material is ignored
)",
       {1, 1, 0, 0}},
      {"ArrayOpenBeforeADirective",
       world("Shape \"sphere\" \"float radius\" [ 2\nIdentity"),
       R"(scene.pbrt:2:31: error: "[" without its "]": the values of parameter "radius" run into "Identity"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"ArrayOpenAtTheEndOfTheFile",
       "WorldBegin" + kTri + "\n\nShape \"sphere\" \"float radius\" [ 2",
       R"(scene.pbrt:3:31: error: "[" without its "]": the values of parameter "radius" run into the end of the file; the parameter is ignored
scene.pbrt:3:34: warning: the file ends without WorldEnd
)",
       {2, 9801, 0, 0}},
      {"StringArrayOpenAtTheEndOfTheFile",
       "WorldBegin" + kTri + "\nMaterial \"matte\" \"string x\" [ \"a\" \"b\"",
       R"(scene.pbrt:2:29: error: "[" without its "]": the values of parameter "x" run into the end of the file; the parameter is ignored
scene.pbrt:2:38: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"MatrixOpenBeforeADirective",
       world("Transform [ 1 0 0 0  0 1 0 0\nIdentity"),
       R"(scene.pbrt:2:11: error: "[" without its "]": found "Identity" in the matrix
)",
       {1, 1, 0, 0}},
      {"MatrixOpenAtTheEndOfTheFile",
       "WorldBegin" + kTri + "ConcatTransform [ 1 0",
       R"(scene.pbrt:1:107: error: "[" without its "]": found the end of the file in the matrix
scene.pbrt:1:112: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"ArrayInsideAnArray",
       world("Shape \"sphere\" \"float radius\" [ [ 2 ] ]"),
       R"(scene.pbrt:2:33: error: expected a number or "]" in parameter "radius", found "["; the parameter is ignored
scene.pbrt:2:39: error: expected a parameter or a directive, found "]"; it is ignored
)",
       {2, 9801, 0, 0}},
      {"StrayClosingBracket",
       world("Identity ]"),
       R"(scene.pbrt:2:10: error: expected a directive, found "]"
)",
       {1, 1, 0, 0}},
      {"StrayOpeningBracket",
       world("[ Identity"),
       R"(scene.pbrt:2:1: error: expected a directive, found "["
)",
       {1, 1, 0, 0}},
      {"StrayString",
       world("\"Shape\" \"sphere\""),
       R"(scene.pbrt:2:1: error: expected a directive, found the string "Shape"
)",
       {1, 1, 0, 0}},
      {"StrayNumber",
       world("Identity 5 Identity"),
       R"(scene.pbrt:2:10: error: expected a directive, found the number "5"
)",
       {1, 1, 0, 0}},
      {"StrayNumbers",
       world("Identity -1.5e3 7 8 Identity\n.5\nIdentity +2 Identity 3rd"),
       R"(scene.pbrt:2:10: error: expected a directive, found the number "-1.5e3"
scene.pbrt:3:1: error: expected a directive, found the number ".5"
scene.pbrt:4:10: error: expected a directive, found the number "+2"
scene.pbrt:4:22: error: expected a directive, found the number "3rd"
)",
       {1, 1, 0, 0}},
      {"WordsThatBeginLikeNumbers",
       world("Info\nNaming\ninfinite\nE5"),
       R"(scene.pbrt:2:1: error: unknown directive "Info"
scene.pbrt:3:1: error: unknown directive "Naming"
scene.pbrt:4:1: error: unknown directive "infinite"
scene.pbrt:5:1: error: unknown directive "E5"
)",
       {1, 1, 0, 0}},
      {"MegabyteWord",
       world(std::string(1 << 20, 'x')),
       R"(scene.pbrt:2:1: error: unknown directive "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."
)",
       {1, 1, 0, 0}},
      {"MegabyteString",
       world("Material \"" + std::string(1 << 20, 'x') + "\""),
       R"(scene.pbrt:2:1: error: unknown material "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."; matte is used
)",
       {1, 1, 0, 0}},
      {"MegabyteComment", world("#" + std::string(1 << 20, '"')), "", {1, 1, 0, 0}},
      {"MegabyteNumber", world("Scale 2 2 2." + std::string(1 << 20, '5')), "", {1, 1, 0, 0}},
      {"MegabyteDeclaration",
       world(kTri + "\"float " + std::string(1 << 20, 'r') + "\" 2"),
       R"(scene.pbrt:2:81: warning: parameter "float rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr..." is not used
)",
       {2, 2, 0, 0}},
      {"NumbersWithLettersBehind",
       world("Translate 1.2.3 1e 0x10"),
       R"(scene.pbrt:2:11: warning: number "1.2.3" has other characters after it; they are ignored
scene.pbrt:2:17: warning: number "1e" has other characters after it; they are ignored
scene.pbrt:2:20: warning: number "0x10" has other characters after it; they are ignored
)",
       {1, 1, 0, 0}},
      {"NumbersWithCommas",
       world("LookAt 0,0,0 1,1,1 0,1,0"),
       R"(scene.pbrt:2:1: error: LookAt takes 9 numbers, found 3; it is ignored
scene.pbrt:2:8: warning: number "0,0,0" has other characters after it; they are ignored
scene.pbrt:2:14: warning: number "1,1,1" has other characters after it; they are ignored
scene.pbrt:2:20: warning: number "0,1,0" has other characters after it; they are ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"NumbersWithTwoSigns",
       world("Translate --1 0 0"),
       R"(scene.pbrt:2:1: error: Translate takes 3 numbers, found 0; it is ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"NumbersWithADecimalComma",
       world("Scale 1,5 1,5 1,5"),
       R"(scene.pbrt:2:7: warning: number "1,5" has other characters after it; they are ignored (3 times, first here)
)",
       {1, 1, 0, 0}},
      {"FewerNumbers",
       world("Scale 2 2"),
       R"(scene.pbrt:2:1: error: Scale takes 3 numbers, found 2; it is ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"MoreNumbers",
       world("Translate 1 2 3 4"),
       R"(scene.pbrt:2:1: error: Translate takes 3 numbers, found 4; it is ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"BracketsWithinNumbers",
       world("Rotate 90 [ 0 0 1 ]"),
       R"(scene.pbrt:2:1: error: Rotate takes 4 numbers, found 1; it is ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"FifteenOfSixteenNumbers",
       world("Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 ]"),
       R"(scene.pbrt:2:1: error: Transform takes 16 numbers, found 15; it is ignored
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"EndsAfterShape",
       "WorldBegin" + kTri + "Shape",
       R"(scene.pbrt:1:96: error: expected a quoted name after Shape, found the end of the file; Shape is ignored
scene.pbrt:1:96: warning: the file ends without WorldEnd
)",
       {1, 1, 1, 0}},
      {"EndsWithinNumbers",
       "WorldBegin" + kTri + "Translate 1 2",
       R"(scene.pbrt:1:91: error: Translate takes 3 numbers, found 2; it is ignored
scene.pbrt:1:104: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"EndsAfterOneOfThreeNames",
       "WorldBegin" + kTri + "Texture \"a\"",
       R"(scene.pbrt:1:102: error: expected a quoted name after Texture, found the end of the file; Texture is ignored
scene.pbrt:1:102: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"EndsAfterInclude",
       "WorldBegin" + kTri + "Include",
       R"(scene.pbrt:1:98: error: expected a quoted name after Include, found the end of the file; Include is ignored
scene.pbrt:1:98: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"EndsAfterActiveTransform",
       "WorldBegin" + kTri + "ActiveTransform",
       R"(scene.pbrt:1:106: error: expected All, StartTime or EndTime after ActiveTransform, found the end of the file; it is ignored
scene.pbrt:1:106: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"EndsAfterADeclaration",
       "WorldBegin" + kTri + "Shape \"sphere\" \"float radius\"",
       R"(scene.pbrt:1:120: error: expected a value for parameter "radius", found the end of the file; the parameter is ignored
scene.pbrt:1:120: warning: the file ends without WorldEnd
)",
       {2, 9801, 0, 0}},
  };
}

std::vector<HostileCase> parameters() {
  return {
      {"DeclarationWithoutName",
       world("Shape \"sphere\" \"float\" 2"),
       R"(scene.pbrt:2:16: error: a parameter is declared as "type name", found "float"; it is ignored
)",
       {2, 9801, 0, 0}},
      {"DeclarationEmpty",
       world("Shape \"sphere\" \"\" 2"),
       R"(scene.pbrt:2:16: error: a parameter is declared as "type name", found ""; it is ignored
)",
       {2, 9801, 0, 0}},
      {"DeclarationWithoutSpace",
       world("Shape \"sphere\" \"floatradius\" 2"),
       R"(scene.pbrt:2:16: error: a parameter is declared as "type name", found "floatradius"; it is ignored
)",
       {2, 9801, 0, 0}},
      {"DeclarationWithExtraSpaces", world(kTri + "\" \t float \t alpha \" 1"), "", {2, 2, 0, 0}},
      {"UnknownParameterType",
       world("Shape \"sphere\" \"flaot radius\" 2"),
       R"(scene.pbrt:2:16: error: unknown parameter type "flaot" in "flaot radius"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"ParameterTypesMisspelled",
       world(kTri + "\"flot alpha\" 1 \"Float alpha\" 1 \"texure alpha\" \"t\"\n\"Normal N\" [0 0 1] "
                    "\"intger i\" 1 \"spectrm Kd\" [1 1]\n\"strings s\" [\"a\"] \"colour Kd\" [1 1 1]"),
       R"(scene.pbrt:2:81: error: unknown parameter type "flot" in "flot alpha"; the parameter is ignored; did you mean "float"?
scene.pbrt:2:96: error: unknown parameter type "Float" in "Float alpha"; the parameter is ignored; did you mean "float"?
scene.pbrt:2:112: error: unknown parameter type "texure" in "texure alpha"; the parameter is ignored; did you mean "texture"?
scene.pbrt:3:1: error: unknown parameter type "Normal" in "Normal N"; the parameter is ignored; did you mean "normal"?
scene.pbrt:3:20: error: unknown parameter type "intger" in "intger i"; the parameter is ignored; did you mean "integer"?
scene.pbrt:3:33: error: unknown parameter type "spectrm" in "spectrm Kd"; the parameter is ignored; did you mean "spectrum"?
scene.pbrt:4:1: error: unknown parameter type "strings" in "strings s"; the parameter is ignored; did you mean "string"?
scene.pbrt:4:19: error: unknown parameter type "colour" in "colour Kd"; the parameter is ignored; did you mean "color"?
)",
       {2, 2, 0, 0}},
      {"DeclarationWithThreeWords",
       world(kTri + "\"float alpha beta\" 0.5\n\"float \talpha  beta gamma\" 0.5"),
       R"(scene.pbrt:2:81: warning: "float alpha beta" has more than a type and a name; the rest is ignored
scene.pbrt:3:1: warning: "float \x09alpha  beta gamma" has more than a type and a name; the rest is ignored
scene.pbrt:3:1: warning: parameter "float alpha" is given again; the last one counts
)",
       {2, 2, 0, 0}},
      {"DeclarationOfUnknownTypeWithThreeWords",
       world("Shape \"sphere\" \"my float radius\" 2"),
       R"(scene.pbrt:2:16: error: unknown parameter type "my" in "my float radius"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"UnknownParameterTypeWithArray",
       world("Shape \"sphere\" \"quaternion q\" [ 1 2 3 4 ] \"float radius\" 2"),
       R"(scene.pbrt:2:16: error: unknown parameter type "quaternion" in "quaternion q"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"BoolThatIsNeither",
       world("AreaLightSource \"diffuse\" \"bool twosided\" \"yes\""),
       R"(scene.pbrt:2:43: warning: "yes" is neither "true" nor "false"; read as false
)",
       {1, 1, 0, 0}},
      {"BoolAsNumber",
       world("AreaLightSource \"diffuse\" \"bool twosided\" 1"),
       R"(scene.pbrt:2:43: error: expected a value for parameter "twosided", found "1"; the parameter is ignored
)",
       {1, 1, 0, 0}},
      {"BoolWithoutQuotes", world("AreaLightSource \"diffuse\" \"bool twosided\" true"), "", {1, 1, 0, 0}},
      {"StringForAFloat",
       world("Shape \"sphere\" \"float radius\" \"2\""),
       R"(scene.pbrt:2:31: error: expected a value for parameter "radius", found the string "2"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"NumberForAString",
       world("Shape \"plymesh\" \"string filename\" 7"),
       R"(scene.pbrt:2:1: error: plymesh without a "string filename"; the shape is skipped
scene.pbrt:2:35: error: expected a value for parameter "filename", found "7"; the parameter is ignored
)",
       {1, 1, 1, 0}},
      {"MixedArray",
       world("Shape \"sphere\" \"float radius\" [ 1 \"two\" ]"),
       R"(scene.pbrt:2:35: error: expected a number or "]" in parameter "radius", found the string "two"; the parameter is ignored
)",
       {2, 9801, 0, 0}},
      {"FractionForAnInteger",
       world("Shape \"loopsubdiv\" \"integer levels\" 1.5 \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:37: warning: integer expected, found "1.5"; the fraction is cut off
)",
       {2, 5, 0, 0}},
      {"EmptyArrays",
       world("Shape \"trianglemesh\" \"integer indices\" [ ] \"point P\" [ ]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "integer indices"
)",
       {1, 1, 1, 0}},
      {"IncompletePoint",
       world("Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0 5 5]"),
       R"(scene.pbrt:2:48: warning: parameter "point P" takes values in groups of 3, found 11; the last 2 are ignored
)",
       {2, 2, 0, 0}},
      {"ValueMissing",
       world("Shape \"sphere\" \"float radius\" \"float zmin\" 0"),
       R"(scene.pbrt:2:31: error: expected a value for parameter "radius", found the string "float zmin"; the parameter is ignored
)",
       {2, 4901, 0, 0}},
      {"SameParameterTwice",
       world("Shape \"sphere\" \"float radius\" 2 \"float radius\" -1"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: the sphere's radius is not positive
scene.pbrt:2:33: warning: parameter "float radius" is given again; the last one counts
)",
       {1, 1, 1, 0}},
      {"MisspelledParameter",
       world(kTri + "\"float Alpha\" 1 \"point2 UV\" [ 0 0 ]\n\"float shadowalhpa\" 1"),
       R"(scene.pbrt:2:81: warning: parameter "float Alpha" is not used; did you mean "alpha"?
scene.pbrt:2:97: warning: parameter "point2 UV" is not used
scene.pbrt:3:1: warning: parameter "float shadowalhpa" is not used; did you mean "shadowalpha"?
)",
       {2, 2, 0, 0}},
      {"WrongParameterType",
       world(kTri + "\"integer alpha\" 1 \"point N\" [ 0 0 1 ]"),
       R"(scene.pbrt:2:81: warning: parameter "integer alpha" is ignored: it has the wrong type or number of values here
scene.pbrt:2:99: warning: parameter "point N" is ignored: it has the wrong type or number of values here
)",
       {2, 2, 0, 0}},
  };
}

/// A bad parameter is lost alone: the shape and its other parameters stay. The default radius is 1.
std::vector<HostileCase> lost_parameters() {
  return {
      {"TypeUnknownOfOneAmongMany",
       world("Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"foo bar\" [1 \"x\" 2] \"point P\" [0 0 0 1 0 0 0 1 "
             "0]"),
       R"(scene.pbrt:2:48: error: unknown parameter type "foo" in "foo bar"; the parameter is ignored
)",
       {2, 2, 0, 0}},
      {"StringAmongTheNumbersOfN",
       world(kTri + "\"normal N\" [0 0 1 \"0\" 0 1] \"float alpha\" 1"),
       R"(scene.pbrt:2:99: error: expected a number or "]" in parameter "N", found the string "0"; the parameter is ignored
)",
       {2, 2, 0, 0}},
      {"StringAmongTheIndices",
       world("Shape \"trianglemesh\" \"integer indices\" [0 \"1\" 2] \"point P\" [0 0 0 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "integer indices"
scene.pbrt:2:43: error: expected a number or "]" in parameter "indices", found the string "1"; the parameter is ignored
)",
       {1, 1, 1, 0}},
      {"StringAmongThePoints",
       world("Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 \"x\" 1 0 0 0 1 0]"),
       R"(scene.pbrt:2:1: error: Shape "trianglemesh" is skipped: no "point P"
scene.pbrt:2:65: error: expected a number or "]" in parameter "P", found the string "x"; the parameter is ignored
)",
       {1, 1, 1, 0}},
      {"UnterminatedListBeforeAParameter",
       world(kTri + "\"normal N\" [0 0 1 0 0 1 \"float alpha\" 0"),
       R"(scene.pbrt:2:92: error: "[" without its "]": the values of parameter "N" run into the string "float alpha"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"UnterminatedListOfStringsBeforeAParameter",
       world("Shape \"plymesh\" \"string x\" [\"a\" \"b\" \"float alpha\" [0]"),
       R"(scene.pbrt:2:28: error: "[" without its "]": the values of parameter "x" run into the parameter "float alpha"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"UnterminatedListOfUnknownType",
       world(kTri + "\"foo bar\" [1 2 \"float alpha\" 0"),
       R"(scene.pbrt:2:81: error: unknown parameter type "foo" in "foo bar"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"UnterminatedListOfBools",
       world("AreaLightSource \"diffuse\" \"bool twosided\" [\"true\" \"rgb L\" [0 0 0]"),
       R"(scene.pbrt:2:43: error: "[" without its "]": the values of parameter "twosided" run into the string "rgb L"; the parameter is ignored
)",
       {1, 1, 0, 0}},
      {"ValuesMissingOfEveryType",
       world(
           kTri +
           "\"integer i\" \"float f\" \"bool b\" \"rgb c\" \"spectrum s\" \"point p\" \"string t\" \"float alpha\" 0"),
       R"(scene.pbrt:2:93: error: expected a value for parameter "i", found the string "float f"; the parameter is ignored
scene.pbrt:2:103: error: expected a value for parameter "f", found the string "bool b"; the parameter is ignored
scene.pbrt:2:112: error: expected a value for parameter "b", found the string "rgb c"; the parameter is ignored
scene.pbrt:2:120: error: expected a value for parameter "c", found the string "spectrum s"; the parameter is ignored
scene.pbrt:2:133: error: expected a value for parameter "s", found the string "point p"; the parameter is ignored
scene.pbrt:2:143: error: expected a value for parameter "p", found the string "string t"; the parameter is ignored
scene.pbrt:2:154: error: expected a value for parameter "t", found the parameter "float alpha"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"ValueMissingOfATexture",
       world(kTri + "\"texture Kd\" \"float alpha\" [0]"),
       R"(scene.pbrt:2:94: error: expected a value for parameter "Kd", found the parameter "float alpha"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"ValueThatReadsLikeADeclaration",
       world("Texture \"float noise\" \"float\" \"constant\" \"float value\" 0\n" + kTri +
             "\"texture alpha\" \"float noise\" \"float shadowalpha\" 1"),
       R"(scene.pbrt:6:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"NumbersWithoutBrackets",
       world(kTri + "\"normal N\" 0 0 1 \"float alpha\" 0"),
       R"(scene.pbrt:2:81: warning: parameter "normal N" takes values in groups of 3, found 1; the last 1 are ignored
scene.pbrt:2:94: error: expected a parameter or a directive after "normal N", found the number "0"; numbers are ignored here
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"ListsWithoutAParameter",
       world("Shape \"sphere\" [1 2] \"float radius\" [0] [3 \"x\"] ]"),
       R"(scene.pbrt:2:1: error: Shape "sphere" is skipped: the sphere's radius is not positive
scene.pbrt:2:16: error: expected a parameter or a directive, found "["; it is ignored
scene.pbrt:2:41: error: expected a parameter or a directive after "float radius", found "["; it is ignored
scene.pbrt:2:49: error: expected a parameter or a directive after "float radius", found "]"; it is ignored
)",
       {1, 1, 1, 0}},
      {"WordsAmongParameters",
       world(kTri + "oops \"float alpha\" yes \"normal N\" [ 1 up 0 ] \"float alpha\" 0"),
       R"(scene.pbrt:2:81: error: expected a parameter or a directive, found "oops"; it is ignored
scene.pbrt:2:100: error: expected a value for parameter "alpha", found "yes"; the parameter is ignored
scene.pbrt:2:119: error: expected a number or "]" in parameter "N", found "up"; the parameter is ignored
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"MisspelledDirectiveBehindParameters",
       world(
           "Shape \"sphere\" \"float radius\" 2 Shpe \"disk\" \"float radius\" -1\nShape \"disk\" \"float radius\" -1"),
       R"(scene.pbrt:2:33: error: unknown directive "Shpe"; did you mean "Shape"?
scene.pbrt:3:1: error: Shape "disk" is skipped: the disk's radius is not positive
)",
       {2, 9801, 1, 0}},
      {"BadBytesInAndBetweenParameters",
       world(kTri +
             "\1 \"float alpha\" \2 \"normal N\" [0 \3 1] \"string s\" \"a\4b\5\" \"flo\6at x\" 1 \"float alpha\" 0"),
       R"(scene.pbrt:2:81: error: byte 0x01 does not belong in a pbrt file
scene.pbrt:2:97: error: byte 0x02 does not belong in a pbrt file
scene.pbrt:2:97: error: expected a value for parameter "alpha", found a stray byte; the parameter is ignored
scene.pbrt:2:113: error: byte 0x03 does not belong in a pbrt file
scene.pbrt:2:113: error: expected a number or "]" in parameter "N", found a stray byte; the parameter is ignored
scene.pbrt:2:131: error: byte 0x04 does not belong in a pbrt file
scene.pbrt:2:131: error: expected a value for parameter "s", found a stray byte; the parameter is ignored
scene.pbrt:2:140: error: byte 0x06 does not belong in a pbrt file
scene.pbrt:2:147: error: expected a parameter or a directive after "point P", found the number "1"; numbers are ignored here
scene.pbrt:5:1: note: 1 shape is left out: its alpha is 0 everywhere
)",
       {1, 1, 0, 0}},
      {"EveryDirectiveNamesWhatItLoses",
       "Camera \"perspective\" \"float fov\" \"wide\"\nFilm \"image\" \"integer xresolution\" [8 \"x\"]\n"
       "Sampler \"halton\" \"intger pixelsamples\" 4\nIntegrator \"path\" \"integer maxdepth\"\nPixelFilter \"box\" "
       "\"float xwidth\" [\n"
       "Accelerator \"bvh\" \"bool x\" 1\n" +
           world(
               "Material \"matte\" \"rgb Kd\" [1 0 \"0\"]\nTexture \"t\" \"float\" \"constant\" \"float value\" true\n"
               "LightSource \"point\" \"blackbody I\" \"hot\"\nAreaLightSource \"diffuse\" \"rgb L\" (1 1 1)\n"
               "MakeNamedMaterial \"m\" \"string type\" 5\nMakeNamedMedium \"fog\" \"rgb sigma_a\" [\nMediumInterface "
               "\"fog\""),
       R"(scene.pbrt:1:34: error: expected a value for parameter "fov", found the string "wide"; the parameter is ignored
scene.pbrt:2:39: error: expected a number or "]" in parameter "xresolution", found the string "x"; the parameter is ignored
scene.pbrt:3:18: error: unknown parameter type "intger" in "intger pixelsamples"; the parameter is ignored; did you mean "integer"?
scene.pbrt:5:1: error: expected a value for parameter "maxdepth", found "PixelFilter"; the parameter is ignored
scene.pbrt:5:34: error: "[" without its "]": the values of parameter "xwidth" run into "Accelerator"; the parameter is ignored
scene.pbrt:6:28: error: expected a value for parameter "x", found "1"; the parameter is ignored
scene.pbrt:8:32: error: expected a number or "]" in parameter "Kd", found the string "0"; the parameter is ignored
scene.pbrt:9:46: error: expected a value for parameter "value", found "true"; the parameter is ignored
scene.pbrt:10:35: error: expected a value for parameter "I", found the string "hot"; the parameter is ignored
scene.pbrt:11:35: error: expected a value for parameter "L", found "(1"; the parameter is ignored
scene.pbrt:11:38: error: expected a parameter or a directive, found the number "1"; numbers are ignored here
scene.pbrt:12:1: error: MakeNamedMaterial "m" has no "string type"; matte is used
scene.pbrt:12:37: error: expected a value for parameter "type", found "5"; the parameter is ignored
scene.pbrt:13:37: error: "[" without its "]": the values of parameter "sigma_a" run into "MediumInterface"; the parameter is ignored
)",
       {1, 1, 0, 0}},
      {"ParameterGivenManyTimes",
       world(kTri + repeated("\"float alpha\" 1\n", 20'000) + "\"texture alpha\" \"t\""),
       R"(scene.pbrt:3:1: warning: parameter "float alpha" is given again; the last one counts (19999 times, first here)
scene.pbrt:20001:1: warning: parameter "float alpha" is ignored: it has the wrong type or number of values here
scene.pbrt:20002:1: error: no float texture "t" for parameter "texture alpha"
)",
       {2, 2, 0, 0}},
      {"DirectivesWithoutTheirNames",
       world("Shape 5 \"float radius\" 1\nMaterial\nObjectBegin" + kTri + "ObjectEnd\nObjectInstance\nShape \"a\1b\""),
       R"(scene.pbrt:2:7: error: expected a quoted name after Shape, found "5"; Shape is ignored
scene.pbrt:4:1: error: expected a quoted name after Material, found "ObjectBegin"; Material is ignored
scene.pbrt:4:13: error: expected a quoted name after ObjectBegin, found "Shape"; ObjectBegin is ignored
scene.pbrt:6:1: error: expected a quoted name after ObjectInstance, found "Shape"; ObjectInstance is ignored
scene.pbrt:6:9: error: byte 0x01 does not belong in a pbrt file
scene.pbrt:6:9: error: expected a quoted name after Shape, found a stray byte; Shape is ignored
scene.pbrt:4:1: warning: object "" is never instanced: left out
)",
       {1, 1, 2, 0}},
  };
}

std::vector<HostileCase> blocks() {
  const std::string tri = kTri;
  return {
      {"WorldEndMissing",
       "WorldBegin" + tri,
       R"(scene.pbrt:1:91: warning: the file ends without WorldEnd
)",
       {1, 1, 0, 0}},
      {"WorldBeginMissing",
       "Identity" + tri + "WorldEnd",
       R"(scene.pbrt:1:10: error: Shape belongs between WorldBegin and WorldEnd; it is ignored
scene.pbrt:1:89: error: WorldEnd belongs between WorldBegin and WorldEnd; it is ignored
scene.pbrt:1:97: warning: the file ends without WorldBegin: the scene is empty
)",
       {0, 0, 0, 0}},
      {"WorldBeginTwice",
       world("WorldBegin"),
       R"(scene.pbrt:2:1: error: WorldBegin inside the world block; it is ignored
)",
       {1, 1, 0, 0}},
      {"WorldEndTwice",
       world("") + "WorldEnd",
       R"(scene.pbrt:5:1: error: WorldEnd belongs between WorldBegin and WorldEnd; it is ignored
)",
       {1, 1, 0, 0}},
      {"ShapeBeforeTheWorld",
       tri + world(""),
       R"(scene.pbrt:1:2: error: Shape belongs between WorldBegin and WorldEnd; it is ignored
)",
       {1, 1, 0, 0}},
      {"OptionsInTheWorld",
       world("Camera \"perspective\" Film \"image\" Sampler \"halton\" TransformTimes 0 1"),
       R"(scene.pbrt:2:1: error: Camera belongs before WorldBegin; it is ignored
scene.pbrt:2:22: error: Film belongs before WorldBegin; it is ignored
scene.pbrt:2:35: error: Sampler belongs before WorldBegin; it is ignored
scene.pbrt:2:52: error: TransformTimes belongs before WorldBegin; it is ignored
)",
       {1, 1, 0, 0}},
      {"EndsWithoutBegin",
       world("AttributeEnd\nTransformEnd\nObjectEnd"),
       R"(scene.pbrt:2:1: error: AttributeEnd without AttributeBegin
scene.pbrt:3:1: error: TransformEnd without TransformBegin
scene.pbrt:4:1: error: ObjectEnd without ObjectBegin
)",
       {1, 1, 0, 0}},
      {"AttributeAndTransformCrossed",
       world("AttributeBegin\nTransformBegin Scale 2 2 2\nAttributeEnd\nTransformEnd"),
       R"(scene.pbrt:4:1: error: AttributeEnd closes the TransformBegin at scene.pbrt:3:1, which has no TransformEnd before it
scene.pbrt:5:1: error: TransformEnd without TransformBegin
)",
       {1, 1, 0, 0}},
      {"ObjectAndAttributeCrossed",
       world("ObjectBegin \"o\"\nAttributeBegin" + tri + "\nObjectEnd\nAttributeEnd\nObjectInstance \"o\""),
       R"(scene.pbrt:4:1: error: ObjectEnd closes the AttributeBegin at scene.pbrt:3:1, which has no AttributeEnd before it
scene.pbrt:5:1: error: AttributeEnd without AttributeBegin
)",
       {2, 2, 0, 0}},
      {"AttributeClosesAnObject",
       world("AttributeBegin\nObjectBegin \"o\"" + tri + "\nAttributeEnd\nObjectEnd\nObjectInstance \"o\""),
       R"(scene.pbrt:4:1: error: AttributeEnd closes the ObjectBegin at scene.pbrt:3:1, which has no ObjectEnd before it
scene.pbrt:5:1: error: ObjectEnd without ObjectBegin
)",
       {2, 2, 0, 0}},
      {"BlocksLeftOpen",
       "WorldBegin\nAttributeBegin TransformBegin\nObjectBegin \"o\"" + tri + "\nWorldEnd",
       R"(scene.pbrt:2:1: warning: AttributeBegin without its AttributeEnd before the world ends at scene.pbrt:4:1
scene.pbrt:2:16: warning: TransformBegin without its TransformEnd before the world ends at scene.pbrt:4:1
scene.pbrt:3:1: warning: ObjectBegin without its ObjectEnd before the world ends at scene.pbrt:4:1
scene.pbrt:3:1: warning: object "o" is never instanced: left out
)",
       {0, 0, 0, 0}},
      {"ObjectInAnObject",
       world("ObjectBegin \"a\"\nObjectBegin \"b\"" + tri +
             "\nObjectEnd\nObjectEnd\nObjectInstance \"a\"\nObjectInstance \"b\""),
       R"(scene.pbrt:3:1: error: ObjectBegin "b" inside object "a"; its shapes belong to the outer object
scene.pbrt:7:1: error: no object "b"; the instance is skipped
)",
       {2, 2, 0, 0}},
      {"InstanceOfItself",
       world("ObjectBegin \"a\"\nObjectInstance \"a\"\nObjectEnd"),
       R"(scene.pbrt:3:1: error: ObjectInstance "a" inside object "a"; objects cannot hold instances
)",
       {1, 1, 0, 0}},
      {"InstanceInAnObject",
       world("ObjectBegin \"a\"" + tri + "ObjectEnd\nObjectBegin \"b\"\nObjectInstance \"a\"" + tri +
             "ObjectEnd\nObjectInstance \"b\""),
       R"(scene.pbrt:4:1: error: ObjectInstance "a" inside object "b"; objects cannot hold instances
scene.pbrt:2:1: warning: object "a" is never instanced: left out
)",
       {2, 2, 0, 0}},
      {"InstanceOfNothing",
       world("ObjectInstance \"tree\""),
       R"(scene.pbrt:2:1: error: no object "tree"; the instance is skipped
)",
       {1, 1, 0, 0}},
      {"InstanceBeforeItsObject",
       world("ObjectInstance \"a\"\nObjectBegin \"a\"" + tri + "ObjectEnd"),
       R"(scene.pbrt:2:1: error: no object "a"; the instance is skipped
scene.pbrt:3:1: warning: object "a" is never instanced: left out
)",
       {1, 1, 0, 0}},
      {"InstanceMisspelled",
       world("ObjectBegin \"Tree1\"" + tri + "ObjectEnd ObjectInstance \"tree1\""),
       R"(scene.pbrt:2:110: error: no object "tree1"; the instance is skipped; did you mean "Tree1"?
scene.pbrt:2:1: warning: object "Tree1" is never instanced: left out
)",
       {1, 1, 0, 0}},
      {"ObjectTwice",
       world("ObjectBegin \"a\"" + tri + "ObjectEnd\nObjectInstance \"a\"\nObjectBegin \"a\"" + tri + tri +
             "ObjectEnd\nObjectInstance \"a\""),
       R"(scene.pbrt:4:1: warning: object "a" is defined again; later instances show the new one, unlike the one at scene.pbrt:2:1
)",
       {4, 4, 0, 0}},
      {"ObjectWithoutName", world("ObjectBegin \"\"" + tri + "ObjectEnd ObjectInstance \"\""), "", {2, 2, 0, 0}},
      {"EmptyObject", world("ObjectBegin \"a\" ObjectEnd ObjectInstance \"a\""), "", {1, 1, 0, 0}},
      {"ThousandDeepAttributes",
       world(repeated("AttributeBegin\n", 1000) + kTri + repeated("AttributeEnd\n", 1000)),
       "",
       {2, 2, 0, 0}},
      {"HundredThousandDeepAttributes",
       world(repeated("AttributeBegin\n", 100'000) + kTri + repeated("AttributeEnd\n", 100'000)),
       R"(scene.pbrt:65538:1: error: blocks are nested more than 65536 deep; deeper ones do not keep the state apart (34464 times, first here)
)",
       {2, 2, 0, 0}},
      {"HundredThousandDeepTransforms",
       world(repeated("TransformBegin Scale -1 1 1\n", 100'000) + kTri + repeated("TransformEnd\n", 100'000)),
       R"(scene.pbrt:65538:1: error: blocks are nested more than 65536 deep; deeper ones do not keep the state apart (34464 times, first here)
)",
       {2, 2, 0, 0}},
      {"HundredThousandDeepObjects",
       world(repeated("ObjectBegin \"a\"\n", 100'000) + kTri + repeated("ObjectEnd\n", 100'000)),
       R"(scene.pbrt:3:1: error: ObjectBegin "a" inside object "a"; its shapes belong to the outer object (65535 times, first here)
scene.pbrt:65538:1: error: blocks are nested more than 65536 deep; deeper ones do not keep the state apart (34464 times, first here)
scene.pbrt:2:1: warning: object "a" is never instanced: left out
)",
       {1, 1, 0, 0}},
      {"SixtyThousandBlocksNeverClosed",
       "WorldBegin\n" + repeated("AttributeBegin\n", 60'000),
       R"(scene.pbrt:2:1: warning: AttributeBegin without its AttributeEnd before the world ends at scene.pbrt:60002:1 (60000 times, first here)
scene.pbrt:60002:1: warning: the file ends without WorldEnd
)",
       {0, 0, 0, 0}},
      {"HundredThousandEndsTooMany",
       world(repeated("AttributeEnd\n", 100'000)),
       R"(scene.pbrt:2:1: error: AttributeEnd without AttributeBegin (100000 times, first here)
)",
       {1, 1, 0, 0}},
      {"DirectiveInLowerCase",
       world("shape \"sphere\""),
       R"(scene.pbrt:2:1: error: unknown directive "shape"; did you mean "Shape"?
)",
       {1, 1, 0, 0}},
      {"DirectiveMisspelled",
       world("AttributBegin\nIdentity\nTrnslate 1 0 0\nIdentity\nAtributeEnd\nIdentity"),
       R"(scene.pbrt:2:1: error: unknown directive "AttributBegin"; did you mean "AttributeBegin"?
scene.pbrt:4:1: error: unknown directive "Trnslate"; did you mean "Translate"?
scene.pbrt:6:1: error: unknown directive "AtributeEnd"; did you mean "AttributeEnd"?
)",
       {1, 1, 0, 0}},
      {"DirectivesMisspelledInARow",
       world("AttributBegin\nTrnslate 1 0 0\nAtributeEnd"),
       R"(scene.pbrt:2:1: error: unknown directive "AttributBegin"; did you mean "AttributeBegin"?
scene.pbrt:3:1: error: unknown directive "Trnslate"; did you mean "Translate"?
scene.pbrt:4:1: error: unknown directive "AtributeEnd"; did you mean "AttributeEnd"?
)",
       {1, 1, 0, 0}},
      {"DirectivesMisspelledWithArguments",
       world("  Matrial \"matte\" \"rgb Kd\"\n    [ 1 0 0 ]\n\t\"float sigma\"\n  10\n  -5 nan\n"
             "  shpe \"sphere\" Shap\nIdentity"),
       R"(scene.pbrt:2:3: error: unknown directive "Matrial"; did you mean "Material"?
scene.pbrt:7:3: error: unknown directive "shpe"; did you mean "Shape"?
)",
       {1, 1, 0, 0}},
      {"DirectiveMisspelledBehindOneThatIsIgnored",
       world("Scale 1\nTrnslate 1 0 0\nShape\nTrnslte 1 0 0\nIdentity"),
       R"(scene.pbrt:2:1: error: Scale takes 3 numbers, found 1; it is ignored
scene.pbrt:3:1: error: unknown directive "Trnslate"; did you mean "Translate"?
scene.pbrt:5:1: error: expected a quoted name after Shape, found "Trnslte"; Shape is ignored
)",
       {1, 1, 1, 0}},
      {"ActiveTransformInQuotes",
       world("ActiveTransform \"All\""),
       R"(scene.pbrt:2:17: error: expected All, StartTime or EndTime after ActiveTransform, found the string "All"; it is ignored
)",
       {1, 1, 0, 0}},
      {"ActiveTransformSometimes",
       world("ActiveTransform Sometimes"),
       R"(scene.pbrt:2:1: error: ActiveTransform takes All, StartTime or EndTime, found "Sometimes"
)",
       {1, 1, 0, 0}},
      {"ActiveTransformMisspelled",
       world("ActiveTransform all\nActiveTransform StartTim\nActiveTransform Endtime"),
       R"(scene.pbrt:2:1: error: ActiveTransform takes All, StartTime or EndTime, found "all"; did you mean "All"?
scene.pbrt:3:1: error: ActiveTransform takes All, StartTime or EndTime, found "StartTim"; did you mean "StartTime"?
scene.pbrt:4:1: error: ActiveTransform takes All, StartTime or EndTime, found "Endtime"; did you mean "EndTime"?
)",
       {1, 1, 0, 0}},
      {"CoordinateSystemsMisspelled",
       "Camera \"perspective\"\n" +
           world("CoordinateSystem \"Sun1\"\nCoordSysTransform \"sun1\"\nCoordSysTransform \"camra\"\n"
                 "CoordSysTransform \"World\""),
       R"(scene.pbrt:4:1: error: no coordinate system "sun1"; the transform stays; did you mean "Sun1"?
scene.pbrt:5:1: error: no coordinate system "camra"; the transform stays; did you mean "camera"?
scene.pbrt:6:1: error: no coordinate system "World"; the transform stays; did you mean "world"?
scene.pbrt:7:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"CoordinateSystemUndefined",
       world("CoordSysTransform \"nowhere\""),
       R"(scene.pbrt:2:1: error: no coordinate system "nowhere"; the transform stays
scene.pbrt:3:2: warning: this shape may stand in a wrong place: a transform before it is ignored
)",
       {1, 1, 0, 0}},
      {"NameWithoutQuotes",
       world("Shape sphere"),
       R"(scene.pbrt:2:7: error: expected a quoted name after Shape, found "sphere"; Shape is ignored
)",
       {1, 1, 1, 0}},
      {"MediumInterfaceWithoutNames",
       world("MediumInterface"),
       R"(scene.pbrt:3:2: error: expected a quoted name after MediumInterface, found "Shape"; MediumInterface is ignored
)",
       {1, 1, 0, 0}},
  };
}

// Large inputs

/// CPU time of an import, and its result.
struct Timed {
  double seconds = 0.0;
  Imported imported;
};
Timed timed_import(const SceneFolder& folder, const std::string& text) {
  const std::filesystem::path scene = folder.write("scene.pbrt", text);
  const std::clock_t start = std::clock();
  Imported imported = import_file(scene);
  return {static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, std::move(imported)};
}

/// Four times the input must take less than ten times as long; inputs that are too fast to measure pass.
void expect_linear(const Timed& small, const Timed& four_times) {
  constexpr double kMeasurableSeconds = 0.05;
  EXPECT_LT(four_times.seconds, 10.0 * std::max(small.seconds, kMeasurableSeconds));
}

/// Concatenates item(0) to item(count - 1).
template <class Item>
std::string listed(int count, Item item) {
  std::string all;
  for (int i = 0; i < count; ++i) all += item(i);
  return all;
}

TEST(HostileSizes, MillionParametersOnOneDirective) {
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(kTri + listed(count, [](int i) { return numbered("\"float p", i) + "\" 1\n"; })));
  };
  const Timed small = import(250'000), large = import(1'000'000);
  expect_linear(small, large);
  EXPECT_EQ(kept_of(large.imported), (Kept{2, 2, 0, 0}));
  EXPECT_EQ(to_string(large.imported.diagnostics.back()),
            "warning: 990000 further problems are not listed: only the first 10000 different ones are");
}

TEST(HostileSizes, SameParameterAMillionTimes) {
  const SceneFolder folder;
  const Timed large = timed_import(folder, world(kTri + repeated("\"float alpha\" 0 ", 999'999) + "\"float alpha\" 1"));
  EXPECT_EQ(
      without_folder(large.imported.text(), folder),
      "scene.pbrt:2:97: warning: parameter \"float alpha\" is given again; the last one counts (999999 times, first "
      "here)\n");
  EXPECT_EQ(kept_of(large.imported), (Kept{2, 2, 0, 0}));
}

TEST(HostileSizes, TwentyThousandObjectsThatAreNeverInstanced) {
  const SceneFolder folder;
  const Imported imported = import_world(
      folder, listed(20'000, [](int i) { return numbered("ObjectBegin \"o", i) + "\"" + kTri + "ObjectEnd\n"; }));
  EXPECT_EQ(without_folder(imported.text(), folder),
            "scene.pbrt:1:12: warning: object \"o0\" and 19999 more are never instanced: left out\n");
}

TEST(HostileSizes, HundredThousandUnknownDirectives) {
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(listed(count, [](int i) { return numbered("Nonsense", i) + " Identity\n"; })));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(large.imported.count(Severity::kError), 10'001u);
  EXPECT_EQ(to_string(large.imported.diagnostics.back()),
            "error: 90000 further problems are not listed: only the first 10000 different ones are");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, HundredThousandCrossedBlocks) {
  const SceneFolder folder;
  const auto import = [&](size_t count) {
    return timed_import(folder, world(repeated("AttributeBegin TransformBegin\nAttributeEnd\n", count)));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(
      without_folder(to_string(large.imported.diagnostics.front()), folder),
      "scene.pbrt:3:1: error: AttributeEnd closes the TransformBegin at scene.pbrt:2:16, which has no TransformEnd "
      "before it");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, HundredThousandUnknownMaterials) {
  const SceneFolder folder;
  const auto import = [&](int count) {
    return timed_import(folder, world(listed(count, [](int i) { return numbered("Material \"matte", i) + "\"\n"; })));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.front()), folder),
            "scene.pbrt:2:1: error: unknown material \"matte0\"; matte is used; did you mean \"matte\"?");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, ThousandsOfUnknownNamedMaterialsAmongThousands) {
  const SceneFolder folder;
  const auto import = [&](int unknown, int defined) {
    return timed_import(
        folder, world(listed(defined,
                             [](int i) {
                               return numbered("MakeNamedMaterial \"metal", i) + "\" \"string type\" \"metal\"\n";
                             }) +
                      listed(unknown, [](int i) { return numbered("NamedMaterial \"metl", i) + "\"\n"; })));
  };
  const Timed small = import(1000, 2250), large = import(4000, 9000);
  expect_linear(small, large);
  ASSERT_EQ(large.imported.diagnostics.size(), 4000u);
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.front()), folder),
            "scene.pbrt:9002:1: error: no named material \"metl0\"; the material before it stays; did you mean "
            "\"metal0\"?");
  EXPECT_EQ(without_folder(to_string(large.imported.diagnostics.back()), folder), // no hints after too many comparisons
            "scene.pbrt:13001:1: error: no named material \"metl3999\"; the material before it stays");
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

TEST(HostileSizes, FileNameOfAHundredThousandFolders) {
  const SceneFolder folder;
  const auto import = [&](size_t count) {
    return timed_import(folder, world("Include \"" + repeated("a/../b/", count) + "x\""));
  };
  const Timed small = import(25'000), large = import(100'000);
  expect_linear(small, large);
  ASSERT_EQ(large.imported.diagnostics.size(), 1u);
  EXPECT_TRUE(large.imported.diagnostics[0].message.ends_with("...\": cannot open: File name too long"));
  EXPECT_EQ(kept_of(large.imported), (Kept{1, 1, 0, 0}));
}

// Locales

class DecimalComma : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// Sets C++'s global locale to decimal commas, and C's if such a locale is installed, during its lifetime.
class CommaLocale {
public:
  CommaLocale()
      : before_(std::locale::global(std::locale(std::locale::classic(), new DecimalComma))),
        c_before_(std::setlocale(LC_ALL, nullptr)) {
    for (const char* const name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8", "es_ES.UTF-8"})
      if (std::setlocale(LC_ALL, name)) break;
  }
  ~CommaLocale() {
    std::locale::global(before_);
    std::setlocale(LC_ALL, c_before_.c_str());
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

private:
  std::locale before_;
  std::string c_before_;
};

TEST(HostileLocales, DecimalCommasChangeNothing) {
  const SceneFolder folder;
  folder.write("a.ply", kPly);
  folder.write("a.spd", "400 0.5 700 0.25");
  const std::string text =
      world("Scale 1.5 1.5 1.5 Material \"matte\" \"spectrum Kd\" \"a.spd\"\n" + ply_shape("a.ply") +
            "Texture \"t\" \"float\" \"constant\" \"float value\" 1.5e400\n" + repeated("AttributeEnd\n", 1234));
  const Imported plain = import_text(folder, text);
  const CommaLocale comma;
  const Imported imported = import_text(folder, text);
  EXPECT_EQ(imported.text(), plain.text());
  EXPECT_TRUE(imported.reported("(1234 times, first here)")) << imported.text();
  EXPECT_EQ(imported.scene.materials[0].albedo, plain.scene.materials[0].albedo);
  ASSERT_EQ(imported.scene.shapes.size(), 2u);
  EXPECT_EQ(placed(imported.scene.shapes[0], imported.scene, 1), DVec3(1.5, 0, 0));
}

const bool kRegistered = register_cases("HostileEncodings", encodings(), __FILE__) &&
                         register_cases("HostileTokens", tokens(), __FILE__) &&
                         register_cases("HostileParameters", parameters(), __FILE__) &&
                         register_cases("HostileLostParameters", lost_parameters(), __FILE__) &&
                         register_cases("HostileBlocks", blocks(), __FILE__);

} // namespace
} // namespace packtrace
