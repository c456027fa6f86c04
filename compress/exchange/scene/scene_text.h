#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compress/exchange/scene/exported_file.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Appends numbers with the fewest digits that read back as the same value, separated by spaces.
void append_number(std::string& text, float value);
void append_number(std::string& text, double value);
void append_number(std::string& text, int64_t value);
template <class T>
void append_numbers(std::string& text, std::span<const T> values) {
  for (size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ' ';
    append_number(text, values[i]);
  }
}

/// A name as scene files can hold it: UTF-8 without control characters, quotes, backslashes and, for formats that end
/// names there, spaces; unique by its number.
std::string plain_name(std::string_view name, uint32_t number, bool allow_spaces);

std::vector<std::byte> bytes_of_text(std::string_view text);

/// Names of the PNG files of all textures, "FOLDER/texture_3.png", and then of all masks, "FOLDER/mask_3.png".
std::vector<std::string> image_files(const BakedFile& file, const std::string& folder);
/// Adds these files.
void add_images(const BakedFile& file, const std::string& folder, SceneExport& result);
std::string texture_file(const std::string& folder, uint32_t texture);
std::string mask_file(const std::string& folder, uint32_t mask);

} // namespace packtrace
