# Debian packages by cpack -G DEB (script/package): waymark is the program, libwaymark-dev the libraries,
# python3-waymark the Python module where that is built.
#
# What is packed is built by the target waymark_packed, without tests and examples.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
add_custom_target(waymark_packed DEPENDS waymark)
foreach(module ${waymark_modules})
  add_dependencies(waymark_packed waymark_${module})
endforeach()
if(TARGET waymark_python)
  add_dependencies(waymark_packed waymark_python)
endif()

set(CPACK_PACKAGE_VENDOR "The Waymark authors")
set(CPACK_PACKAGE_CONTACT "The Waymark authors <authors@waymark.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
get_cmake_property(CPACK_COMPONENTS_ALL COMPONENTS)
list(FILTER CPACK_COMPONENTS_ALL INCLUDE REGEX "^(program|dev|python)$")
set(CPACK_COMPONENTS_GROUPING IGNORE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME waymark)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "python3-waymark (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})") # For fleet and import.
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "visual SLAM for any camera
Waymark finds out from images where a camera was and what the place looks like.
The camera may be perspective, fisheye or 360 degrees, alone, one of a stereo
pair, or beside a depth sensor. Maps can be watched in the browser while they
grow, saved, joined, extended, and exported to COLMAP, nerfstudio and PLY.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libwaymark-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "libeigen3-dev, libopencv-dev, libavformat-dev, libavcodec-dev, libswscale-dev, libyaml-cpp-dev, libfmt-dev, libhwy-dev, libdeflate-dev, libbz2-dev, liblz4-dev, libzstd-dev, libsqlite3-dev, pkg-config")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "waymark (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_COMPONENT_DEV_DESCRIPTION "visual SLAM for any camera, libraries to build with
Waymark finds out from images where a camera was and what the place looks like.
This package has its static C++ libraries, their headers, and the CMake package
that find_package(waymark) finds.")

if(WAYMARK_BUILD_PYTHON)
  math(EXPR WAYMARK_NEXT_PYTHON "${Python3_VERSION_MINOR} + 1") # An extension is for one minor version.
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-waymark)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
if("python" IN_LIST CPACK_COMPONENTS_ALL) # An extension fits one version of Python.
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}~), python3 (<< 3.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-msgpack") # Of waymark.importing.
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-distributed, python3-fsspec") # Of waymark.fleet.
endif()
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "visual SLAM for any camera, Python module
Waymark finds out from images where a camera was and what the place looks like.
This package has its module for Python, with images and poses as numpy arrays.")

# What every package has beside its files: copyright, changelog, compressed manual page.
file(READ "${PROJECT_SOURCE_DIR}/viewer/dist/licenses.txt" THREE_LICENSE)
string(STRIP "${THREE_LICENSE}" THREE_LICENSE)
string(REGEX REPLACE "\n" "\n " THREE_LICENSE " ${THREE_LICENSE}")
string(REGEX REPLACE "\n \n" "\n .\n" THREE_LICENSE "${THREE_LICENSE}")
configure_file("${PROJECT_SOURCE_DIR}/packaging/copyright.in"
               "${CMAKE_CURRENT_BINARY_DIR}/packaging/copyright" @ONLY)
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(CONFIGURE OUTPUT packaging/changelog.Debian CONTENT [=[
waymark (@PROJECT_VERSION@-@CPACK_DEBIAN_PACKAGE_RELEASE@) unstable; urgency=medium

  * Packages made by the sources themselves. What is new is in changelog.gz.

 -- @CPACK_PACKAGE_CONTACT@  @now@
]=] @ONLY)
configure_file(CHANGELOG.md packaging/changelog COPYONLY)
set(CPACK_PRE_BUILD_SCRIPTS "${CMAKE_CURRENT_LIST_DIR}/WaymarkPackageDocuments.cmake")
set(CPACK_WAYMARK_DOCUMENTS "${CMAKE_CURRENT_BINARY_DIR}/packaging")
include(CPack)
