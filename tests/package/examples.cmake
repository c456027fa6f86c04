# Builds docs/examples against the installed package and runs each program.
file(REMOVE_RECURSE ${WORK})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/docs/examples -B ${WORK} -DCMAKE_PREFIX_PATH=${INSTALLED}
  ${CONFIGURE_OPTIONS} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK} COMMAND_ERROR_IS_FATAL ANY)

# run(EXPECTED PROGRAM ARGUMENT...) fails unless the program succeeds and writes a line like EXPECTED.
function(run expected program)
  execute_process(COMMAND ${WORK}/${program} ${ARGN} OUTPUT_VARIABLE output RESULT_VARIABLE result)
  message("$ ${program} ${ARGN}\n${output}")
  if(NOT result EQUAL 0 OR NOT output MATCHES "${expected}")
    message(FATAL_ERROR "${program} ended with ${result}; expected \"${expected}\" in its output")
  endif()
endfunction()

run("46[0-9]+ triangles" bake_scene ${SOURCE}/assets/room/room.pbrt ${WORK}/room.ptk)
run("cluster 0: [1-9][0-9]* triangles" read_cluster ${WORK}/room.ptk)
run("mean visibility 0\\.[0-9]+" trace_ao ${WORK}/room.ptk ${WORK}/room.png)
run("decoded [1-9][0-9]+ vertices" decode_vertex16 ${WORK}/room.ptk)
