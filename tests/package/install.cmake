# Installs all components of BUILD into INSTALLED.
file(REMOVE_RECURSE ${INSTALLED})
set(components dev tools)
if(PYTHON)
  list(APPEND components python)
endif()
foreach(component ${components})
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${INSTALLED} --component ${component}
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()
