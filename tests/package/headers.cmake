# Compiles every installed header against the installed package alone.
file(REMOVE_RECURSE ${WORK})
file(GLOB_RECURSE headers RELATIVE ${INSTALLED}/include/packtrace ${INSTALLED}/include/packtrace/*.h)
list(LENGTH headers count)
if(count LESS 40)
  message(FATAL_ERROR "Only ${count} headers are installed")
endif()
list(TRANSFORM headers REPLACE "(.+)" "#include \"\\1\"\n")
string(CONCAT text ${headers})
file(WRITE ${WORK}/source/headers.cpp "${text}int main() {}\n")
file(COPY ${SOURCE}/tests/package/headers/CMakeLists.txt DESTINATION ${WORK}/source)
execute_process(COMMAND ${CMAKE_COMMAND} -S ${WORK}/source -B ${WORK}/build -DCMAKE_PREFIX_PATH=${INSTALLED}
  ${CONFIGURE_OPTIONS} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/build COMMAND_ERROR_IS_FATAL ANY)
