# Warnings for our own code; no fused multiply-add contraction, so that results do not depend on
# what the compiler chose to fuse.
add_library(waymark_options INTERFACE)
target_compile_options(waymark_options INTERFACE "$<BUILD_INTERFACE:-Wall;-Wextra>" -ffp-contract=off)
target_compile_features(waymark_options INTERFACE cxx_std_20)
target_include_directories(waymark_options INTERFACE
  "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")

if(WAYMARK_BUILD_TESTS)
  add_custom_target(waymark_unit_tests)
endif()

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
  set_property(GLOBAL APPEND PROPERTY WAYMARK_MODULES ${name})
  target_link_libraries(waymark_${name} PUBLIC waymark_options ${MODULE_LINK})
  if(WAYMARK_BUILD_PYTHON) # Its extension is a shared library that holds the modules.
    set_target_properties(waymark_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  if(WAYMARK_BUILD_TESTS AND MODULE_TESTS)
    add_executable(waymark_${name}_test ${MODULE_TESTS})
    target_link_libraries(waymark_${name}_test PRIVATE waymark_${name} ${MODULE_TEST_LINK}
                          GTest::gmock_main)
    add_dependencies(waymark_unit_tests waymark_${name}_test)
    if(WAYMARK_TEST_WHOLE_PROGRAMS)
      add_test(NAME ${name} COMMAND waymark_${name}_test)
      set_tests_properties(${name} PROPERTIES TIMEOUT 900 LABELS unit)
    else()
      gtest_discover_tests(waymark_${name}_test TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                           PROPERTIES TIMEOUT 300 LABELS unit)
    endif()
  endif()
endfunction()
