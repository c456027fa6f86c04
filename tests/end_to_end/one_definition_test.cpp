// Two source files that define different types with the same name break the one-definition rule, and no compiler or
// linker reports it. packtrace_all_headers (CMakeLists.txt) compiles all headers together; this test also checks types
// in .cpp files.

#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Returns the end of the literal whose opening quote is at `at`.
size_t end_of_literal(const std::string& text, size_t at) {
  const char quote = text[at];
  if (at > 0 && text[at - 1] == 'R' && quote == '"') {
    const size_t open = text.find('(', at);
    const std::string close = ")" + text.substr(at + 1, open - at - 1) + "\"";
    return text.find(close, open) + close.size();
  }
  for (++at; at < text.size() && text[at] != quote; ++at) at += text[at] == '\\';
  return at + 1;
}

/// Splits a text into words and single other characters; "::" is one token. Skips comments, literals and preprocessor
/// lines.
std::vector<std::string> tokens_of(const std::string& text) {
  std::vector<std::string> tokens;
  bool line_start = true;
  for (size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (text.compare(i, 2, "//") == 0 || (c == '#' && line_start)) {
      for (; i < text.size() && text[i] != '\n'; ++i) i += text[i] == '\\';
    } else if (text.compare(i, 2, "/*") == 0) {
      i = text.find("*/", i) + 2;
    } else if (c == '"' || (c == '\'' && (i == 0 || !is_word(text[i - 1])))) {
      i = end_of_literal(text, i);
    } else if (is_word(c)) {
      const size_t begin = i;
      while (i < text.size() && (is_word(text[i]) || (text[i] == '\'' && is_word(text[i + 1])))) ++i; // 1'000
      tokens.push_back(text.substr(begin, i - begin));
    } else {
      line_start = c == '\n' || (line_start && std::isspace(static_cast<unsigned char>(c)) != 0);
      const size_t length = text.compare(i, 2, "::") == 0 ? 2 : 1;
      if (std::isspace(static_cast<unsigned char>(c)) == 0) tokens.push_back(text.substr(i, length));
      i += length;
      continue;
    }
    line_start = false;
  }
  return tokens;
}

/// Finds the types that a file defines at namespace scope, with their namespaces; skips anonymous namespaces.
class TypeFinder {
public:
  explicit TypeFinder(const std::string& text) : tokens_(tokens_of(text)) {}

  std::vector<std::string> run() {
    for (size_t i = 0; i < tokens_.size(); ++i) {
      const std::string& token = tokens_[i];
      if (token == "namespace") {
        i = enter_namespace(i + 1);
      } else if (token == "{") {
        scopes_.push_back({"", true});
      } else if (token == "}") {
        if (!scopes_.empty()) scopes_.pop_back();
      } else if (is_key(token) && at_namespace_scope()) {
        const std::string& before = i == 0 ? token : tokens_[i - 1];
        if (before != "<" && before != "," && before != "enum") note_type(i + 1);
      }
    }
    return found_;
  }

private:
  struct Scope {
    std::string name; ///< ends with "::"
    bool hidden;      ///< an anonymous namespace, or a scope that is no namespace
  };

  static bool is_key(const std::string& token) {
    return token == "struct" || token == "class" || token == "union" || token == "enum";
  }

  bool at_namespace_scope() const {
    for (const Scope& scope : scopes_)
      if (scope.hidden) return false;
    return true;
  }

  /// Returns the index of the namespace's opening brace, or where parsing continues after an alias or using directive.
  size_t enter_namespace(size_t i) {
    std::string name;
    for (; i < tokens_.size() && (tokens_[i] == "::" || is_word(tokens_[i][0])); ++i) name += tokens_[i];
    if (i < tokens_.size() && tokens_[i] == "{") scopes_.push_back({name + "::", name.empty()});
    return i;
  }

  void note_type(size_t i) {
    std::string name;
    for (int brackets = 0; i < tokens_.size(); ++i) {
      const std::string& token = tokens_[i];
      brackets += token == "[" || (token == "(" && brackets > 0);
      brackets -= token == "]" || (token == ")" && brackets > 0);
      if (brackets > 0 || token == "]" || token == "class" || token == "struct") continue; // attributes, enum class
      if (token == "alignas") {
        while (i < tokens_.size() && tokens_[i] != ")") ++i;
        continue;
      }
      if (!is_word(token[0])) break;
      if (token != "final") name = token;
    }
    if (name.empty() || i == tokens_.size() || tokens_[i] == "::" || tokens_[i] == "<") return; // skips specialisations
    while (i < tokens_.size() && tokens_[i] != "{" && tokens_[i] != ";" && tokens_[i] != "(" && tokens_[i] != "=") ++i;
    if (i == tokens_.size() || tokens_[i] != "{") return;
    std::string scope;
    for (const Scope& s : scopes_) scope += s.name;
    found_.push_back(scope + name);
  }

  std::vector<std::string> tokens_;
  std::vector<Scope> scopes_;
  std::vector<std::string> found_;
};

std::vector<std::string> types_of(const std::string& text) { return TypeFinder(text).run(); }

TEST(OneDefinition, EveryTypeIsDefinedInOneFile) {
  const fs::path root = PACKTRACE_SOURCE_DIR;
  std::map<std::string, std::string> file_of;
  for (const char* top : {"pbrt_import", "compress", "runtime", "assets"})
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      const std::string path = fs::relative(entry.path(), root).generic_string();
      std::ostringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      for (const std::string& type : types_of(text.str())) {
        const auto [at, added] = file_of.emplace(type, path);
        EXPECT_TRUE(added || at->second == path)
            << type << " is defined in " << at->second << " and in " << path
            << ": give one of them another name, or put it in an anonymous namespace";
      }
    }
  EXPECT_GT(file_of.size(), 300u) << "the tree was not read";
  EXPECT_EQ(file_of.count("packtrace::BakedFile"), 1u);
  EXPECT_EQ(file_of.count("packtrace::baked::GeometryRecord"), 1u);
}

TEST(OneDefinition, TheCheckSeesTypesOfEveryForm) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(types_of("namespace a { struct X { int i; }; class Y final : public X {}; }"), (Names{"a::X", "a::Y"}));
  EXPECT_EQ(types_of("namespace a::b { enum class E : int { kOne }; union U {}; }"), (Names{"a::b::E", "a::b::U"}));
  EXPECT_EQ(types_of("template <typename T, class V> struct alignas(16) X { T t; }; struct [[nodiscard]] Y {};"),
            (Names{"X", "Y"}));
  EXPECT_EQ(types_of("namespace a { class X : public B<int> { struct Inner {}; void f() { struct L {}; } }; }"),
            (Names{"a::X"}));
}

TEST(OneDefinition, TheCheckSkipsWhatIsNoDefinition) {
  EXPECT_TRUE(types_of("namespace { struct X {}; } namespace a { namespace { enum E {}; } }").empty());
  EXPECT_TRUE(types_of("struct X; class Y; template <> struct Z<int> {}; struct X::Inner {};").empty());
  EXPECT_TRUE(types_of("struct X f(int i) { return {}; } // struct C {\nconst char* s = \"struct S {};\";").empty());
  EXPECT_TRUE(
      types_of("#define M struct \\\n P {}\nconst auto r = R\"x(struct R { )\" )x\"; int n = 1'000; char c = '{';")
          .empty());
  EXPECT_EQ(types_of("char c = '\\''; int n = 1'0; struct X {};"), std::vector<std::string>{"X"});
}

} // namespace
