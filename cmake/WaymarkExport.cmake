# Lets a project beside this one use the libraries of this build:
#   find_package(waymark) with -Dwaymark_DIR=BUILD_FOLDER, then waymark::system and so on.
get_property(waymark_modules GLOBAL PROPERTY WAYMARK_MODULES)
set(waymark_targets waymark_options)
set_target_properties(waymark_options PROPERTIES EXPORT_NAME options)
foreach(module ${waymark_modules})
  list(APPEND waymark_targets waymark_${module})
  set_target_properties(waymark_${module} PROPERTIES EXPORT_NAME ${module})
endforeach()
export(TARGETS ${waymark_targets} NAMESPACE waymark:: FILE "${PROJECT_BINARY_DIR}/waymark-targets.cmake")
configure_file("${CMAKE_CURRENT_LIST_DIR}/waymark-config.cmake.in"
               "${PROJECT_BINARY_DIR}/waymark-config.cmake" @ONLY)
