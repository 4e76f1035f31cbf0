# What a program of a user's may include. These headers are installed, with all that they include;
# everything else in src/ may change at any time. `cmake -P` on this file lists them.
cmake_minimum_required(VERSION 3.25)
set(roots
  atlas/add.h
  atlas/atlas.h
  atlas/atlas_localizer.h
  atlas/export_atlas.h
  atlas/optimize_atlas.h
  base/check.h # InputError, which every reader throws
  base/config.h # settings files
  calibrate/calibrate.h # cameras that nobody knows
  camera/calibration.h
  camera/camchain.h
  camera/camera.h
  camera/model_camera.h # own camera models
  camera/registry.h
  camera/rig.h
  camera/testing/camera_test.h # the tests that a camera model has to pass (needs GoogleTest)
  evaluate/evaluation.h
  exchange/exports.h # COLMAP, nerfstudio, PLY
  image/convert.h # colour to grey, depth from metres
  image/image.h
  input/decode.h # images
  input/imu_stream.h # inertial data
  input/input.h # data sets, folders, video files and devices
  input/listing.h
  map/map.h
  mapfile/map_file.h
  results/results.h
  results/trajectory.h
  simulate/sequence.h # rendered sequences with their truth, to test with
  system/localizer.h
  system/settings.h
  system/system.h
  view/publisher.h
  view/viewer.h)

# waymark_public_headers(RESULT) gives the paths below src/, sorted.
function(waymark_public_headers result)
  set(found "")
  set(waiting ${roots})
  list(TRANSFORM waiting PREPEND "waymark/")
  while(waiting)
    list(POP_FRONT waiting header)
    if(header IN_LIST found)
      continue()
    endif()
    list(APPEND found "${header}")
    file(STRINGS "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../src/${header}" includes REGEX "^#include \"waymark/")
    list(TRANSFORM includes REPLACE "^#include \"([^\"]+)\".*" "\\1")
    list(APPEND waiting ${includes})
  endwhile()
  list(SORT found)
  set(${result} ${found} PARENT_SCOPE)
endfunction()

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  waymark_public_headers(headers)
  execute_process(COMMAND "${CMAKE_COMMAND}" -E echo ${headers})
endif()
