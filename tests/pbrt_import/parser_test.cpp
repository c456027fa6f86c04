#include "pbrt_import/language/parser.h"

#include <memory>
#include <span>

#include "pbrt_import/base/error.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

/// Parses text as scene.pbrt in a temporary folder.
class ParserTest : public testing::Test {
protected:
  struct Copy {
    DirectiveKind kind;
    std::array<double, 16> numbers;
    std::vector<std::string> names;
    ParameterList parameters;
    bool damaged;
  };

  std::vector<Copy> parse(std::string_view text, const SourceLimits& limits = {}) {
    SourceFiles files;
    Diagnostics diagnostics;
    Reporter reporter(files, diagnostics);
    SourceStack source(folder_.write("scene.pbrt", text), limits, files, reporter);
    FileNames names(folder_.path(), true);
    Parser parser(source, names, reporter);
    std::vector<Copy> all;
    Directive directive;
    while (parser.next(directive))
      all.push_back({directive.kind,
                     directive.numbers,
                     {directive.names.begin(), directive.names.begin() + directive.name_count},
                     directive.parameters,
                     directive.damaged});
    reporter.finish();
    messages_.clear();
    for (const Diagnostic& diagnostic : diagnostics.entries()) {
      std::string line = to_string(diagnostic);
      for (size_t at; (at = line.find(folder_.path().string() + "/")) != std::string::npos;)
        line.erase(at, folder_.path().string().size() + 1);
      messages_ += line + "\n";
    }
    return all;
  }

  SceneFolder folder_;
  std::string messages_;
};

using K = DirectiveKind;

TEST_F(ParserTest, NumbersAndNames) {
  const auto all = parse("LookAt 1 2 3  4 5 6  7 8 9 Rotate -5 0 0 1\nTransform [1 0 0 0 0 1 0 0 0 0 1 0 2 3 4 1]\n"
                         "MediumInterface \"a\" MediumInterface \"b\" \"c\" ActiveTransform EndTime WorldBegin");
  ASSERT_EQ(all.size(), 7u);
  EXPECT_EQ(all[0].numbers[8], 9);
  EXPECT_EQ(all[1].numbers[0], -5);
  EXPECT_EQ(all[2].numbers[14], 4);
  EXPECT_EQ(all[3].names, std::vector<std::string>{"a"});
  EXPECT_EQ(all[4].names, (std::vector<std::string>{"b", "c"}));
  EXPECT_EQ(all[5].names, std::vector<std::string>{"EndTime"});
  EXPECT_EQ(messages_, "");
}

TEST_F(ParserTest, AllDirectivesAreKnown) {
  const auto all = parse(
      "Accelerator \"bvh\" ActiveTransform All AreaLightSource \"diffuse\" AttributeBegin AttributeEnd Camera \"x\" "
      "ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] CoordSysTransform \"x\" CoordinateSystem \"x\" Film \"image\" "
      "Identity Integrator \"path\" LightSource \"point\" LookAt 0 0 0 0 0 1 0 1 0 MakeNamedMaterial \"m\" "
      "MakeNamedMedium \"m\" Material \"matte\" MediumInterface \"\" \"\" NamedMaterial \"m\" ObjectBegin \"o\" "
      "ObjectEnd "
      "ObjectInstance \"o\" PixelFilter \"box\" ReverseOrientation Rotate 0 0 0 1 Sampler \"halton\" Scale 1 1 1 "
      "Shape \"sphere\" Texture \"t\" \"float\" \"constant\" Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] "
      "TransformBegin "
      "TransformEnd TransformTimes 0 1 Translate 0 0 0 WorldBegin WorldEnd");
  EXPECT_EQ(all.size(), 36u); // all 37 except Include
  EXPECT_EQ(messages_, "");
}

TEST_F(ParserTest, EveryParameterTypeIsRead) {
  const auto all =
      parse("Shape \"x\" \"integer i\" [1 -2] \"float f\" 1.5 \"bool on\" [\"true\"] \"bool off\" \"false\" \"string "
            "s\" \"text\" "
            "\"texture t\" [\"name\"] \"point2 p2\" [1 2] \"vector2 v2\" [1 2] \"point p\" [1 2 3] "
            "\"vector v\" [1 2 3] \"normal n\" [1 2 3] \"rgb r\" [1 2 3] \"color c\" [1 2 3] \"xyz x\" [1 2 3] "
            "\"blackbody k\" [5000 1] \"spectrum sp\" [400 1 500 2] \"spectrum file\" \"a.spd\"");
  ASSERT_EQ(all.size(), 1u);
  const ParameterList& list = all[0].parameters;
  EXPECT_EQ(list.all().size(), 17u);
  EXPECT_EQ(list.integers("i")[1], -2);
  EXPECT_EQ(list.get_float("f", 0), 1.5f);
  EXPECT_TRUE(list.get_bool("on", false));
  EXPECT_FALSE(list.get_bool("off", true));
  EXPECT_EQ(list.get_string("s", ""), "text");
  EXPECT_EQ(list.floats("c", ParameterType::kRgb).size(), 3u);
  EXPECT_EQ(list.find("file", {ParameterType::kSpectrum})->strings.size(), 1u);
  EXPECT_EQ(messages_, "");
}

TEST_F(ParserTest, TrailingCommasAreIgnoredWithAWarning) {
  const auto all = parse("LookAt 278, 273, -800, 278, 273, 0, 0, 1, 0");
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].numbers[2], -800);
  EXPECT_NE(messages_.find("scene.pbrt:1:8: warning: number \"278,\" has other characters after it"), std::string::npos)
      << messages_;
}

TEST_F(ParserTest, WrongNumberOfNumbersDropsTheDirectiveOnly) {
  const auto all = parse("Scale 1 2\nTranslate 1 2 3 4\nIdentity");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_TRUE(all[0].damaged);
  EXPECT_TRUE(all[1].damaged);
  EXPECT_EQ(all[2].kind, K::kIdentity);
  EXPECT_FALSE(all[2].damaged);
  EXPECT_EQ(messages_, "scene.pbrt:1:1: error: Scale takes 3 numbers, found 2; it is ignored\n"
                       "scene.pbrt:2:1: error: Translate takes 3 numbers, found 4; it is ignored\n");
}

TEST_F(ParserTest, UnknownDirectiveIsNamedAndSkipped) {
  const auto all = parse("Identity\n  Trnslate 1 2 [3] \"x\"\nIdentity");
  EXPECT_EQ(all.size(), 2u);
  EXPECT_EQ(messages_, "scene.pbrt:2:3: error: unknown directive \"Trnslate\"; did you mean \"Translate\"?\n");
}

TEST_F(ParserTest, UnterminatedArrayIsBlamedOnItsBracket) {
  const auto all = parse("Shape \"sphere\"\nShape \"trianglemesh\" \"point P\" [ 1 2 3\nIdentity");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_FALSE(all[1].damaged);
  EXPECT_TRUE(all[1].parameters.empty());
  EXPECT_EQ(messages_, "scene.pbrt:2:32: error: \"[\" without its \"]\": the values of parameter \"P\" run into "
                       "\"Identity\"; the parameter is ignored\n");
  parse("Shape \"trianglemesh\" \"point P\" [ 1 2 3\n\n\n");
  EXPECT_EQ(messages_,
            "scene.pbrt:1:32: error: \"[\" without its \"]\": the values of parameter \"P\" run into the end of "
            "the file; the parameter is ignored\n");
}

TEST_F(ParserTest, UnterminatedStringIsBlamedOnItsQuote) {
  const auto all = parse("Shape \"sphere\" \"float radius\n 2\nIdentity");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_TRUE(all[0].parameters.empty());
  EXPECT_EQ(messages_, "scene.pbrt:1:16: error: string without its closing quote: \"float radius\"; it is ignored\n");
}

TEST_F(ParserTest, WordsAmongNumbersAreNamed) {
  const auto all = parse("Shape \"s\" \"float x\" [1 two 3] \"float y\" 4\nIdentity");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].parameters.all().size(), 1u);
  EXPECT_EQ(all[0].parameters.get_float("y", 0), 4);
  EXPECT_EQ(messages_, "scene.pbrt:1:24: error: expected a number or \"]\" in parameter \"x\", found \"two\"; the "
                       "parameter is ignored\n");
}

TEST_F(ParserTest, UndeclaredTypesAreNamed) {
  const auto all = parse("Shape \"s\" \"flot radius\" [1] \"radius\" 2 \"\" 3 \"float z\" 4");
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].parameters.get_float("z", 0), 4);
  EXPECT_NE(messages_.find("1:11: error: unknown parameter type \"flot\" in \"flot radius\""), std::string::npos);
  EXPECT_NE(messages_.find("1:29: error: a parameter is declared as \"type name\", found \"radius\""),
            std::string::npos);
  EXPECT_NE(messages_.find("1:40: error: a parameter is declared as \"type name\", found \"\""), std::string::npos);
}

TEST_F(ParserTest, IncompleteGroupsAreCutWithAWarning) {
  const auto all = parse("Shape \"s\" \"point P\" [1 2 3 4]");
  EXPECT_EQ(all[0].parameters.floats("P", ParameterType::kPoint3).size(), 3u);
  EXPECT_EQ(messages_,
            "scene.pbrt:1:11: warning: parameter \"point P\" takes values in groups of 3, found 4; the last 1 are "
            "ignored\n");
}

TEST_F(ParserTest, OddIntegersAreReported) {
  const auto all = parse("Shape \"s\" \"integer i\" [1.5 3000000000 -1e99 nan 7]");
  const auto values = all[0].parameters.integers("i");
  EXPECT_EQ(std::vector<int32_t>(values.begin(), values.end()),
            (std::vector<int32_t>{1, INT32_MAX, INT32_MIN, INT32_MIN, 7}));
  EXPECT_NE(messages_.find("\"1.5\"; the fraction is cut off"), std::string::npos);
  EXPECT_NE(messages_.find("integer \"3000000000\" does not fit in 32 bits"), std::string::npos);
}

TEST_F(ParserTest, BadBytesAreNamed) {
  const auto all = parse(std::string_view("Identity\n\0\nIdentity \xff Identity", 30));
  EXPECT_EQ(all.size(), 3u);
  EXPECT_EQ(messages_,
            "scene.pbrt:2:1: error: byte 0x00 does not belong in a pbrt file; is this UTF-16 text? save it as "
            "UTF-8\n"
            "scene.pbrt:3:10: error: byte 0xFF does not belong in a pbrt file\n");
}

TEST_F(ParserTest, BinaryFilesAreGivenUp) {
  std::string noise = "Identity ";
  for (int i = 0; i < 200'000; ++i) noise += static_cast<char>((i * 2654435761u) >> 13);
  const auto all = parse(noise);
  EXPECT_EQ(all.size(), 1u);
  EXPECT_NE(messages_.find("this is not a text file; the rest of the file is skipped"), std::string::npos);
}

TEST_F(ParserTest, IncludesAreReadInPlace) {
  folder_.write("sub/a.pbrt", "Scale 2 2 2 Include \"b.pbrt\" Scale 4 4 4");
  folder_.write("b.pbrt", "Scale 3 3 3");
  const auto all = parse("Include \"sub/a.pbrt\" Scale 5 5 5");
  ASSERT_EQ(all.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(all[i].numbers[0], static_cast<double>(i + 2));
}

TEST_F(ParserTest, ParametersGoOnAfterAnIncludedFile) {
  folder_.write("a.pbrt", "Shape \"s\" \"float x\" [1 2");
  const auto all = parse("Include \"a.pbrt\" 3 ] \"float y\" 4");
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].parameters.floats("x", ParameterType::kFloat).size(), 3u);
  EXPECT_EQ(all[0].parameters.get_float("y", 0), 4);
  EXPECT_EQ(messages_, "");
}

TEST_F(ParserTest, ErrorsShowTheChainOfIncludes) {
  folder_.write("a.pbrt", "\n Include \"b.pbrt\"");
  folder_.write("b.pbrt", "Nonsense");
  parse("Include \"a.pbrt\"");
  EXPECT_EQ(messages_, "b.pbrt:1:1: error: unknown directive \"Nonsense\"\n  included from a.pbrt:2:2\n"
                       "  included from scene.pbrt:1:1\n");
}

TEST_F(ParserTest, IncludeCyclesEnd) {
  folder_.write("a.pbrt", "Identity Include \"b.pbrt\" Identity");
  folder_.write("b.pbrt", "Include \"./a.pbrt\" Include \"scene.pbrt\"");
  EXPECT_EQ(parse("Include \"a.pbrt\" Identity").size(), 3u);
  EXPECT_NE(messages_.find("b.pbrt:1:1: error: cannot include \"a.pbrt\": the file includes itself"), std::string::npos)
      << messages_;
  EXPECT_NE(messages_.find("error: cannot include \"scene.pbrt\": the file includes itself"), std::string::npos);
}

TEST_F(ParserTest, SameFileMayBeIncludedAgainAndAgain) {
  folder_.write("a.pbrt", "Identity");
  EXPECT_EQ(parse("Include \"a.pbrt\" Include \"a.pbrt\" Include \"a.pbrt\"").size(), 3u);
  EXPECT_EQ(messages_, "");
}

TEST_F(ParserTest, DoublingIncludesStopAtTheLimit) {
  for (int i = 0; i < 40; ++i) {
    const std::string next = numbered("Include \"f", i + 1) + "\" ";
    folder_.write(numbered("f", i), next + next);
  }
  folder_.write("f40", "Identity");
  SourceLimits limits;
  limits.max_files = 1000;
  parse("Include \"f0\"", limits);
  EXPECT_NE(messages_.find("more than 1000 files are included in all"), std::string::npos);
}

TEST_F(ParserTest, DeepIncludesStopAtTheLimit) {
  for (int i = 0; i < 70; ++i) folder_.write(numbered("f", i), numbered("Include \"f", i + 1) + "\" Identity");
  EXPECT_EQ(parse("Include \"f0\" Identity").size(), 64u);
  EXPECT_NE(messages_.find("f62:1:1: error: included files are nested more than 64 deep; \"f63\" is skipped"),
            std::string::npos)
      << messages_;
}

TEST_F(ParserTest, MissingFilesAndFoldersAreNotIncluded) {
  folder_.write("sub/x", "");
  EXPECT_EQ(parse("Include \"gone.pbrt\" Include \"sub\" Include \"\" Identity").size(), 1u);
  EXPECT_NE(messages_.find("1:1: error: cannot include \"gone.pbrt\": no such file"), std::string::npos);
  EXPECT_NE(messages_.find("cannot include \"sub\": is a directory"), std::string::npos);
  EXPECT_NE(messages_.find("error: empty file name"), std::string::npos);
}

TEST_F(ParserTest, ManyDifferentMistakesAreCountedNotListed) {
  std::string text;
  for (int i = 0; i < 30'000; ++i)
    text += "Scale Bad" + std::to_string(i) + "\nBad" + std::to_string(i) + " Identity\n";
  parse(text);
  EXPECT_NE(messages_.find("error: Scale takes 3 numbers, found 0; it is ignored (30000 times, first here)"),
            std::string::npos);
}

TEST_F(ParserTest, EveryTruncationIsSurvived) {
  const std::string text = "LookAt 1 2 3 4 5 6 7 8 9\nShape \"a\" \"point P\" [1 2 3] \"string s\" [\"x\\\"y\"] # c\n"
                           "Texture \"t\" \"float\" \"constant\" \"bool b\" \"true\" \"integer i\" 5\n";
  const size_t whole = parse(text).size();
  for (size_t size = 0; size < text.size(); ++size) EXPECT_LE(parse(text.substr(0, size)).size(), whole);
}

/// All that a parse found, with the bits of its numbers. Positions are left out.
std::string listing(const auto& directives) {
  std::string all;
  const auto add = [&](const auto& values) {
    for (const auto& value : values) all.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const auto& directive : directives) {
    all += "\n" + std::to_string(static_cast<int>(directive.kind)) + (directive.damaged ? "?" : ":");
    for (const std::string& name : directive.names) all += name + ",";
    if (directive.kind == K::kTranslate && !directive.damaged) add(std::span(directive.numbers).first(3));
    if (directive.kind == K::kConcatTransform && !directive.damaged) add(directive.numbers);
    for (const Parameter& parameter : directive.parameters.all()) {
      all += describe(parameter) + "=";
      add(std::span<const float>(parameter.floats));
      add(std::span<const int32_t>(parameter.integers));
      for (const std::string& string : parameter.strings) all += string + ",";
    }
  }
  return all;
}

TEST_F(ParserTest, CommentsBetweenTokensChangeNothing) {
  // Comments lead to the tokenizer; without them, most of this takes the short way.
  // Tokens end with "|", as blanks belong to strings.
  constexpr std::string_view kTokens =
      R"(Translate|1|-0|2.5e3|Translate|1|2|Translate|1|2|3|4|ObjectInstance|"a b"|ConcatTransform|[|1|0|0|0|)"
      R"(0|1|0|-0|0|0|1|0|7|8|9.5|1|]|Translate|1|1|nan|Scale|1|2|3|NamedMaterial|"m"|Shape|"trianglemesh"|)"
      R"("integer indices"|[|0|1|2|]|"point P"|[|0|1|-0|2.5|3|4|5|]|"float x"|3|"integer n"|-7|"string s"|)"
      R"("float y"|2|"string s"|"v"|"string s"|[|"w"|]|"bool b"|true|"rgb  c"|[|1|2|3|]|"float"|[|1|]|)"
      R"("texture t"|"u"|Texture|"n"|"spectrum"|"constant"|"rgb value"|[|1|]|Bogus|Translate|1|2|"x"|)"
      R"(ObjectInstance|7|AttributeEnd|MediumInterface|"m"|Translate|0|0|x|WorldEnd|)";
  const auto joined = [&](std::string_view gap) {
    std::string text;
    for (const char c : kTokens) c == '|' ? text.append(gap) : text.append(1, c);
    return text;
  };
  const std::string expected = listing(parse(joined(" #\n")));
  for (const std::string_view gap : {" ", "\n", "\r\n", "\t \n ", "\r"})
    EXPECT_EQ(listing(parse(joined(gap))), expected);
}

} // namespace
} // namespace packtrace
