# Run by cpack before it packs: adds to each package its copyright and changelogs, and compresses what
# Debian wants compressed.
set(package_program waymark)
set(package_dev libwaymark-dev)
set(package_python python3-waymark)
function(compress)
  execute_process(COMMAND gzip -9n ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

foreach(component ${CPACK_COMPONENTS_ALL})
  set(root "${CPACK_TEMPORARY_DIRECTORY}/${component}/usr/share")
  set(folder "${root}/doc/${package_${component}}")
  file(COPY "${CPACK_WAYMARK_DOCUMENTS}/" DESTINATION "${folder}"
       FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  compress("${folder}/changelog" "${folder}/changelog.Debian")
  file(GLOB pages "${root}/man/man*/*")
  if(pages)
    compress(${pages})
  endif()
endforeach()
