# cmake --install: component "program" is the program and its documents, "dev" what another project
# needs to build with the libraries. Nothing installed knows where it was built or installed.
include(CMakePackageConfigHelpers)
include(WaymarkPublicHeaders)

waymark_public_headers(headers)
foreach(header ${headers})
  cmake_path(GET header PARENT_PATH folder)
  set(file "${PROJECT_SOURCE_DIR}/src/${header}")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}") # For what it includes.
  install(FILES "${file}" COMPONENT dev
          DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/${folder}")
endforeach()

# A program for a wider instruction set would see other layouts of the same structs.
include(CheckCXXSourceCompiles)
set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
check_cxx_source_compiles("#include <Eigen/Geometry>
static_assert(alignof(Eigen::Quaterniond) == 16);
int main() {}" WAYMARK_ALIGNS_TO_16)
unset(CMAKE_REQUIRED_LIBRARIES)
target_compile_definitions(waymark_options INTERFACE
  "$<INSTALL_INTERFACE:WAYMARK_ALIGNMENT=$<IF:$<BOOL:${WAYMARK_ALIGNS_TO_16}>,16,32>>")

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/waymark")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/installed/waymark-config-version.cmake"
                                 VERSION "${PROJECT_VERSION}" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_LIST_DIR}/waymark-config.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/installed/waymark-config-version.cmake"
        DESTINATION "${package_folder}" COMPONENT dev)
install(EXPORT waymark-targets NAMESPACE waymark:: DESTINATION "${package_folder}" COMPONENT dev)

install(FILES packaging/waymark.1 DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT program)
install(FILES packaging/waymark.bash DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions"
        RENAME waymark COMPONENT program)
install(FILES LICENSE CHANGELOG.md docs/licenses.md viewer/dist/licenses.txt
        DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT documents)
# The pages that messages of the program name (report/documentation.h).
install(FILES README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT program)
install(DIRECTORY docs examples DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT program
        PATTERN "Doxyfile" EXCLUDE PATTERN "*.dox" EXCLUDE PATTERN "*.css" EXCLUDE PATTERN "__pycache__" EXCLUDE)
