#include "tests/pbrt_import/hostile_recipe.h"

#include <cstring>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRgbaFile.h>

#include "tests/pbrt_import/damaged_files.h"
#include "tests/pbrt_import/exr_stream.h"

namespace packtrace {
namespace {

// Images

std::string tga(uint32_t width, uint32_t height, size_t pixels) {
  std::string file(18 + 3 * pixels, '\x40');
  std::memset(file.data(), 0, 18);
  file[2] = 2;
  file[12] = static_cast<char>(width), file[13] = static_cast<char>(width >> 8);
  file[14] = static_cast<char>(height), file[15] = static_cast<char>(height >> 8);
  file[16] = 24;
  return file;
}

std::string bmp(uint32_t width, uint32_t height, size_t pixel_bytes) {
  std::string file(54 + pixel_bytes, '\x40');
  std::memset(file.data(), 0, 54);
  const auto put = [&](size_t at, uint32_t value) { std::memcpy(file.data() + at, &value, 4); };
  file[0] = 'B', file[1] = 'M';
  put(10, 54), put(14, 40), put(18, width), put(22, height), put(26, 24u << 16 | 1);
  return file;
}

std::string exr() {
  StringStream stream;
  {
    const std::vector<Imf::Rgba> pixels(16, Imf::Rgba(0.25f, 0.5f, 0.75f));
    Imf::RgbaOutputFile file(stream, Imf::Header(4, 4), Imf::WRITE_RGB);
    file.setFrameBuffer(pixels.data(), 1, 4);
    file.writePixels(4);
  }
  return stream.text();
}

/// An EXR file with a depth channel but no colour channels.
std::string depth_exr() {
  StringStream stream;
  {
    Imf::Header header(2, 2);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    std::vector<float> depths(4, 1.0f);
    Imf::FrameBuffer buffer;
    buffer.insert("Z",
                  Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(depths.data()), sizeof(float), 2 * sizeof(float)));
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(buffer);
    file.writePixels(2);
  }
  return stream.text();
}

/// exr() with a different maximum corner of its data window.
std::string exr_with_corner(int32_t x, int32_t y) {
  std::string file = exr();
  constexpr std::string_view kName("dataWindow\0box2i\0", 17);
  const size_t at = file.find(kName) + kName.size() + 4 + 8;
  std::memcpy(file.data() + at, &x, 4);
  std::memcpy(file.data() + at + 4, &y, 4);
  return file;
}

// Lines

template <class Number>
Number read_number(std::istream& line) {
  Number number{};
  if (!(line >> number)) throw std::runtime_error("a number is missing");
  return number;
}

/// Reads a quoted text with the escapes \n, \r, \t, \", \\ and \xHH.
std::string read_quoted(std::istream& line) {
  const auto next = [&line] {
    const int c = line.get();
    if (c == std::istream::traits_type::eof()) throw std::runtime_error("a quoted text is not closed");
    return static_cast<char>(c);
  };
  std::string text;
  if ((line >> std::ws).get() != '"') throw std::runtime_error("a quoted text is missing");
  for (char c = next(); c != '"'; c = next()) {
    if (c == '\\') {
      static const std::map<char, char> kEscapes = {{'n', '\n'}, {'r', '\r'}, {'t', '\t'}, {'"', '"'}, {'\\', '\\'}};
      c = next();
      if (const auto escape = kEscapes.find(c); escape != kEscapes.end()) {
        c = escape->second;
      } else if (c == 'x') {
        const std::string digits{next(), next()};
        if (digits.find_first_not_of("0123456789abcdef") != digits.npos) throw std::runtime_error("bad \\x escape");
        c = static_cast<char>(std::stoi(digits, nullptr, 16));
      } else {
        throw std::runtime_error("unknown escape");
      }
    }
    text += c;
  }
  return text;
}

size_t position_in(const std::string& content, std::istream& line) {
  const auto at = read_number<int64_t>(line);
  const auto size = static_cast<int64_t>(content.size());
  if (at < -size || at >= size) throw std::runtime_error("a position outside the file");
  return static_cast<size_t>(at < 0 ? at + size : at);
}

std::string read_floats(std::istream& line) {
  std::string bytes;
  for (std::string word; line >> word;) {
    const float value = std::stof(word); // reads nan too, unlike operator>>
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

std::string read_png(std::istream& line) {
  const auto width = read_number<uint32_t>(line), height = read_number<uint32_t>(line);
  const int bits = read_number<int>(line);
  return png(width, height, bits, read_quoted(line));
}

/// Applies a line to the content of the file it belongs to.
void apply(const std::string& command, std::istream& line, std::string& content) {
  using Command = std::function<void(std::istream&, std::string&)>;
  static const std::map<std::string, Command> kCommands = {
      {"floats", [](std::istream& in, std::string& file) { file += read_floats(in); }},
      {"png", [](std::istream& in, std::string& file) { file += read_png(in); }},
      {"tga",
       [](std::istream& in, std::string& file) {
         const auto width = read_number<uint32_t>(in), height = read_number<uint32_t>(in);
         file += tga(width, height, read_number<size_t>(in));
       }},
      {"bmp",
       [](std::istream& in, std::string& file) {
         const auto width = read_number<uint32_t>(in), height = read_number<uint32_t>(in);
         file += bmp(width, height, read_number<size_t>(in));
       }},
      {"exr", [](std::istream&, std::string& file) { file += exr(); }},
      {"depth_exr", [](std::istream&, std::string& file) { file += depth_exr(); }},
      {"exr_with_corner",
       [](std::istream& in, std::string& file) {
         const auto x = read_number<int32_t>(in);
         file += exr_with_corner(x, read_number<int32_t>(in));
       }},
      {"gzip", [](std::istream&, std::string& file) { file = gzip(file); }},
      {"keep", [](std::istream& in, std::string& file) { file.resize(position_in(file, in)); }},
      {"flip", [](std::istream& in, std::string& file) { file = flipped(file, position_in(file, in)); }},
  };
  const auto found = kCommands.find(command);
  if (found == kCommands.end()) throw std::runtime_error("unknown command " + command);
  found->second(line, content);
}

void append_text(std::istream& line, std::string& content) {
  size_t times = 1;
  if (line.peek() != '"') {
    times = read_number<size_t>(line);
    if ((line >> std::ws).get() != '*') throw std::runtime_error("expected COUNT * \"text\"");
  }
  const std::string text = read_quoted(line);
  for (size_t i = 0; i < times; ++i) content += text;
}

void set_option(std::istream& line, ImportOptions& options) {
  std::string name;
  line >> name;
  if (name == "max_include_depth") {
    options.max_include_depth = read_number<uint32_t>(line);
  } else if (name == "max_included_files") {
    options.max_included_files = read_number<uint64_t>(line);
  } else if (name == "max_file_bytes") {
    options.max_file_bytes = read_number<uint64_t>(line);
  } else if (name == "confined") {
    options.allow_files_outside_scene_folder = false;
  } else {
    throw std::runtime_error("unknown option " + name);
  }
}

void read_line(const std::string& text, HostileInput& input) {
  std::istringstream line(text);
  std::string command;
  if (text.empty() || text[0] == '#') return;
  if (text.starts_with("file ")) {
    input.files.emplace_back(text.substr(5), "");
  } else if (text.starts_with("option ")) {
    line >> command;
    set_option(line, input.options);
  } else if (input.files.empty()) {
    throw std::runtime_error("a line before the first file");
  } else if (text.starts_with("|")) {
    input.files.back().second += text.substr(std::min<size_t>(text.size(), 2)) + "\n";
  } else if (text[0] == '"' || (text[0] >= '0' && text[0] <= '9')) {
    append_text(line, input.files.back().second);
  } else {
    line >> command;
    apply(command, line, input.files.back().second);
  }
  if ((line >> std::ws).peek() != std::istream::traits_type::eof() && !text.starts_with("file ") &&
      !text.starts_with("|"))
    throw std::runtime_error("more than the line takes");
}

} // namespace

HostileInput parse_recipe(std::string_view recipe) {
  HostileInput input;
  std::istringstream lines{std::string(recipe)};
  size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    try {
      read_line(line, input);
    } catch (const std::exception& error) {
      throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
    }
  }
  return input;
}

std::string recipe_bytes(std::string_view lines) {
  return parse_recipe("file x\n" + std::string(lines)).files[0].second;
}

} // namespace packtrace
