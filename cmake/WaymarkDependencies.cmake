# Everything comes from the distribution; nothing is downloaded.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4 REQUIRED COMPONENTS core imgproc imgcodecs videoio calib3d features2d aruco)
find_package(Boost 1.74 REQUIRED) # Headers of Asio and Beast.
find_package(yaml-cpp REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
if(WAYMARK_BUILD_TESTS OR WAYMARK_BUILD_FUZZERS)
  find_path(MSGPACK_INCLUDE_DIR msgpack.hpp REQUIRED) # Its CMake package has another name in each distribution.
endif()
find_package(PkgConfig REQUIRED)
pkg_check_modules(hwy REQUIRED IMPORTED_TARGET libhwy)
if(WAYMARK_VIDEO)
  pkg_check_modules(libav REQUIRED IMPORTED_TARGET libavformat libavcodec libavutil libswscale)
endif()
pkg_check_modules(libdeflate REQUIRED IMPORTED_TARGET libdeflate) # OpenCV comes with it.
# Of bags of ROS.
pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(sqlite3 REQUIRED IMPORTED_TARGET sqlite3)
find_package(BZip2 REQUIRED) # Debian 12 has no pkg-config file of it.
if(WAYMARK_BUILD_TESTS)
  find_package(Ceres 2.1 REQUIRED) # To compare with.
  find_package(GTest REQUIRED)
  include(GoogleTest)
endif()
if(WAYMARK_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
