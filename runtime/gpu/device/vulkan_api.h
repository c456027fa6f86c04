#pragma once

// Vulkan through volk, which looks functions up when the loader is opened, so that nothing links to Vulkan.
#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <volk.h>
