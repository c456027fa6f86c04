#define VK_NO_PROTOTYPES
#define VOLK_IMPLEMENTATION
#include <volk.h>
