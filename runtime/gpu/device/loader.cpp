#include "runtime/gpu/device/loader.h"

#include <dlfcn.h>

#include <map>
#include <mutex>

#include "pbrt_import/base/error.h"
#include "runtime/gpu/device/vulkan_api.h"

namespace packtrace::gpu {

std::string no_device_message(const std::string& missing) {
  return "backend gpu: " + missing + "; use --backend packed";
}

void open_loader(const std::string& library) {
  static std::mutex mutex;
  static std::map<std::string, PFN_vkGetInstanceProcAddr> opened; // libraries stay open until the process ends
  const std::lock_guard lock(mutex);
  PFN_vkGetInstanceProcAddr& get = opened[library];
  if (get == nullptr) {
    void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle != nullptr) get = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(handle, "vkGetInstanceProcAddr"));
    if (get == nullptr)
      throw Error(ErrorKind::kUnsupported, no_device_message("no Vulkan loader (" + library + ") found"));
  }
  volkInitializeCustom(get);
  if (volkGetInstanceVersion() < VK_API_VERSION_1_2)
    throw Error(ErrorKind::kUnsupported, no_device_message("the Vulkan loader is older than 1.2"));
}

} // namespace packtrace::gpu
