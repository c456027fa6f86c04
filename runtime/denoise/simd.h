#pragma once

#include "runtime/simd.h"
