#pragma once

// Vulkan through volk: functions are looked up when the loader is opened, so nothing links to Vulkan.
#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <volk.h>
