# Makes the Debian packages, unpacks them into an empty folder, and looks whether what is in them works there.
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CPACK} --config ${BUILD}/CPackConfig.cmake -B ${WORK}/packages
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
set(root ${WORK}/root)

# unpack(PATTERN DEPENDENCY...) unpacks the package, which must declare the dependencies.
function(unpack pattern)
  file(GLOB package ${WORK}/packages/${pattern})
  execute_process(COMMAND dpkg -x ${package} ${root} COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND dpkg-deb -f ${package} Depends OUTPUT_VARIABLE depends COMMAND_ERROR_IS_FATAL ANY)
  message("${package} depends on ${depends}")
  foreach(dependency ${ARGN})
    if(NOT depends MATCHES "(^|, )${dependency}")
      message(FATAL_ERROR "It should depend on ${dependency}")
    endif()
  endforeach()
endfunction()

unpack(packtrace_*.deb libc6 libembree3 libtbb12 libopenexr libzstd1 libxxhash0)
execute_process(COMMAND ${root}/usr/bin/packtrace --version COMMAND_ERROR_IS_FATAL ANY)
unpack(libpacktrace-dev_*.deb libtbb-dev libembree-dev libglm-dev)
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/docs/examples -B ${WORK}/examples -DCMAKE_PREFIX_PATH=${root}/usr
  ${CONFIGURE_OPTIONS} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
if(PYTHON)
  unpack(python3-packtrace_*.deb python3 python3-numpy libembree3)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env PYTHONPATH=${root}/usr/lib/python3/dist-packages ${PYTHON}
    -c "import packtrace; print(packtrace.__version__)" COMMAND_ERROR_IS_FATAL ANY)
endif()
