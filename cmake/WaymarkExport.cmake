# The umbrella waymark::waymark and the modules waymark::base to waymark::evaluate, for other projects:
#   find_package(waymark) with the installed package, or with -Dwaymark_DIR=BUILD_FOLDER.
get_property(waymark_modules GLOBAL PROPERTY WAYMARK_MODULES)
add_library(waymark_umbrella INTERFACE)
add_library(waymark::waymark ALIAS waymark_umbrella)
set_target_properties(waymark_umbrella PROPERTIES EXPORT_NAME waymark)
set_target_properties(waymark_options PROPERTIES EXPORT_NAME options)
set(waymark_targets waymark_options waymark_umbrella)
foreach(module ${waymark_modules})
  target_link_libraries(waymark_umbrella INTERFACE waymark_${module})
  list(APPEND waymark_targets waymark_${module})
  set_target_properties(waymark_${module} PROPERTIES EXPORT_NAME ${module})
endforeach()
install(TARGETS ${waymark_targets} EXPORT waymark-targets
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT dev)

export(EXPORT waymark-targets NAMESPACE waymark:: FILE "${PROJECT_BINARY_DIR}/waymark-targets.cmake")
configure_file("${CMAKE_CURRENT_LIST_DIR}/waymark-build-config.cmake.in"
               "${PROJECT_BINARY_DIR}/waymark-config.cmake" @ONLY)
