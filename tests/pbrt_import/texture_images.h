#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace packtrace {

/// An uncompressed 24-bit TGA with rows from the top, from grey values of one byte.
inline std::string grey_tga(uint32_t width, uint32_t height, const std::vector<uint8_t>& grey) {
  std::string file(18, '\0');
  file[2] = 2;
  file[12] = static_cast<char>(width), file[13] = static_cast<char>(width >> 8);
  file[14] = static_cast<char>(height), file[15] = static_cast<char>(height >> 8);
  file[16] = 24;
  file[17] = 0x20; // rows start at the top
  for (const uint8_t value : grey) file.append(3, static_cast<char>(value));
  return file;
}

inline std::string pfm(uint32_t width, uint32_t height, const std::vector<float>& rgb) {
  std::string file = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  file.append(reinterpret_cast<const char*>(rgb.data()), rgb.size() * 4);
  return file;
}

} // namespace packtrace
