# Validates a SPIR-V module and writes its words as C++ literals. Fails, and writes nothing, if it is not valid.
# Usage: cmake -D VALIDATOR=spirv-val -D MODULE=in.spv -D OUT=out.inc -P embed_spirv.cmake
execute_process(COMMAND ${VALIDATOR} --target-env vulkan1.2 ${MODULE} RESULT_VARIABLE result ERROR_VARIABLE message
  OUTPUT_VARIABLE message)
if(NOT result EQUAL 0)
  file(REMOVE ${OUT})
  message(FATAL_ERROR "${MODULE} is not valid SPIR-V: ${message}")
endif()
file(READ ${MODULE} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u,\n" words "${bytes}")
file(WRITE ${OUT} "${words}")
