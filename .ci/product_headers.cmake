# Precompiles the headers that most sources of the product include, for builds in batches: reading them takes some four CPU
# seconds a batch.

# packtrace_product_headers(NAME library...) precompiles them for libraries with the same compile options.
function(packtrace_product_headers name first)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp "")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE packtrace_options TBB::tbb)
  foreach(property ${option_properties})
    get_target_property(value ${first} ${property})
    if(value)
      set_property(TARGET ${name} PROPERTY ${property} "${value}")
    endif()
  endforeach()
  target_precompile_headers(${name} PRIVATE
    <algorithm> <array> <atomic> <bit> <charconv> <cmath> <cstddef> <cstdint> <cstring> <filesystem> <functional> <limits> <map>
    <memory> <mutex> <numbers> <numeric> <optional> <span> <string> <string_view> <tuple> <unordered_map> <utility> <vector>
    <glm/glm.hpp> <tbb/blocked_range.h> <tbb/parallel_for.h>)
  foreach(library ${first} ${ARGN})
    target_precompile_headers(${library} REUSE_FROM ${name})
    # With them, GCC 12 warns wrongly about std::string's operator+ in one more way (see -Wno-restrict).
    target_compile_options(${library} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>)
    # Sources with options of their own, such as kernels, cannot use what was compiled without these.
    get_target_property(sources ${library} SOURCES)
    get_target_property(folder ${library} SOURCE_DIR)
    foreach(source ${sources})
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${folder})
      get_source_file_property(options ${source} TARGET_DIRECTORY ${library} COMPILE_OPTIONS)
      if(options)
        set_source_files_properties(${source} TARGET_DIRECTORY ${library} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
      endif()
    endforeach()
  endforeach()
  foreach(target ${name} ${first} ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess> # for ccache
      "$<$<CXX_COMPILER_ID:Clang>:SHELL:-Xclang -fno-pch-timestamp>")
  endforeach()
endfunction()

# One set for each set of options.
set(option_properties COMPILE_OPTIONS POSITION_INDEPENDENT_CODE CXX_VISIBILITY_PRESET VISIBILITY_INLINES_HIDDEN)
if(PACKTRACE_SANITIZE)
  list(APPEND option_properties PACKTRACE_CHECK_ALIGNMENT)
endif()
set(groups)
foreach(library packtrace_scene packtrace_import packtrace_format packtrace_bake packtrace_vertex16 packtrace_exchange
    packtrace_image packtrace_camera packtrace_trace packtrace_lod packtrace_ao packtrace_denoise packtrace_shade packtrace_voxels
    packtrace_gpu packtrace_motion packtrace_layered packtrace_frame packtrace_measured_errors packtrace_scenes)
  if(NOT TARGET ${library}) # left out of this build
    continue()
  endif()
  set(group group)
  foreach(property ${option_properties})
    get_target_property(value ${library} ${property})
    string(APPEND group "_${value}")
  endforeach()
  string(MAKE_C_IDENTIFIER "${group}" group)
  list(APPEND groups ${group})
  list(APPEND libraries_of_${group} ${library})
endforeach()
list(REMOVE_DUPLICATES groups)
set(number 0)
foreach(group ${groups})
  packtrace_product_headers(packtrace_product_headers_${number} ${libraries_of_${group}})
  math(EXPR number "${number} + 1")
endforeach()
