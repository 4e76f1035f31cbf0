# Warnings for our own code; no fused multiply-add contraction, so that results do not depend on
# what the compiler chose to fuse.
add_library(waymark_options INTERFACE)
target_compile_options(waymark_options INTERFACE "$<BUILD_INTERFACE:-Wall;-Wextra>" -ffp-contract=off
  "$<BUILD_INTERFACE:-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=>") # Nothing built knows where.
target_compile_features(waymark_options INTERFACE cxx_std_20)
target_include_directories(waymark_options INTERFACE
  "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")

if(WAYMARK_BUILD_TESTS)
  add_custom_target(waymark_unit_tests)
endif()

# waymark_test_program(NAME SOURCES...): a program of GoogleTest. Its own code is optimised little:
# compiling that took longer than running it.
function(waymark_test_program name)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE GTest::gmock_main)
  target_compile_options(${name} PRIVATE -O1)
endfunction()

# waymark_module(NAME SOURCES a.cc... [TESTS a_test.cc...] [LINK PUBLIC targets...]
#                [TEST_LINK targets...])
#
# What only the .cc files need of another library's headers is linked as $<BUILD_INTERFACE:target>, so
# that who links the installed module needs no such package.
#
# One static library waymark_NAME and, when there are tests, one test program waymark_NAME_test.
# Modules link the modules above them only, so that an include against the order fails to link.
function(waymark_module name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;TESTS;LINK;TEST_LINK" ${ARGN})
  add_library(waymark_${name} STATIC ${MODULE_SOURCES})
  add_library(waymark::${name} ALIAS waymark_${name})
  foreach(source ${MODULE_SOURCES}) # What Highway compiles once per instruction set stays a unit of its own.
    file(STRINGS ${source} per_instruction_set REGEX "hwy/foreach_target.h")
    if(per_instruction_set)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
  set_property(GLOBAL APPEND PROPERTY WAYMARK_MODULES ${name})
  target_link_libraries(waymark_${name} PUBLIC waymark_options ${MODULE_LINK})
  if(WAYMARK_BUILD_PYTHON) # Its extension is a shared library that holds the modules.
    set_target_properties(waymark_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  if(WAYMARK_BUILD_TESTS AND MODULE_TESTS)
    waymark_test_program(waymark_${name}_test ${MODULE_TESTS})
    target_link_libraries(waymark_${name}_test PRIVATE waymark_${name} ${MODULE_TEST_LINK})
    add_dependencies(waymark_unit_tests waymark_${name}_test)
    if(WAYMARK_TEST_WHOLE_PROGRAMS)
      add_test(NAME ${name} COMMAND waymark_${name}_test)
      set_tests_properties(${name} PROPERTIES TIMEOUT 1500 LABELS unit)
    else()
      gtest_discover_tests(waymark_${name}_test TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                           PROPERTIES TIMEOUT 1500 LABELS unit)
    endif()
  endif()
endfunction()
