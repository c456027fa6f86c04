#pragma once

#include <string>

namespace packtrace::gpu {

/// Opens the Vulkan loader once per process and name; later calls return at once. Throws Error(kUnsupported) if the
/// library is missing or has no Vulkan 1.2.
void open_loader(const std::string& library);

/// "no Vulkan device with ... found; use --backend packed".
std::string no_device_message(const std::string& missing);

} // namespace packtrace::gpu
