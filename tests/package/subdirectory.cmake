# Configures a project that has packtrace as a subdirectory.
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/tests/package/subdirectory -B ${WORK} -DPACKTRACE=${SOURCE}
  ${CONFIGURE_OPTIONS} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
