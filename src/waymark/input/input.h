// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Data sets, folders, videos and cameras, frame by frame.
//
//   const std::unique_ptr<Input> source = open_input("recording.mp4", InputOptions());
//   while (const std::optional<InputFrame> frame = source->next()) {
//     if (frame->fault != FrameFault::kNone) continue;
//     std::cout << frame->timestamp_ns << " ns, " << frame->images.size() << " images\n";
//   }

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/image/image.h"
#include "waymark/imu/imu.h"

namespace waymark {

struct ImuStream;

/// How two cameras come in one picture, or in one file.
enum class Split { kNone, kSideBySide, kTopBottom, kTracks };

/// What the messages of a bag are timed by: the stamps in their headers, or when they were
/// recorded.
enum class BagTimes { kHeaders, kRecording };

/// Which images of a moment are used together.
enum class Setup { kMono, kStereo, kRgbd };

/// "mono", "stereo", "rgbd".
std::string_view to_string(Setup setup);

/// Why the images of a frame cannot be used.
enum class FrameFault {
  kNone,
  kUnreadable,
  kWrongSize,
  kLate,  ///< There was no time for it.
};

/// The images of one moment. With a fault there are none.
struct InputFrame {
  std::size_t index = 0;            ///< In the whole INPUT, before --first, --every.
  std::int64_t timestamp_ns = 0;    ///< Increases from frame to frame.
  std::vector<Image> images;        ///< Grey, one per camera of the setup.
  std::optional<DepthImage> depth;  ///< Of camera 0; nothing where the moment has no depth image.
  std::int64_t depth_lag_ns = 0;    ///< How much later the depth image was taken.
  std::optional<Image> mask;        ///< Of camera 0; 0 where the image is not to be used.
  std::string jpeg;                 ///< Of camera 0 in colour, if that was asked for.
  /// The same of camera 1, of data sets and folders of images; of other inputs empty.
  std::string right_jpeg = {};
  std::string name = {};  ///< Of its image file, as from INPUT, if that was asked for.
  FrameFault fault = FrameFault::kNone;  ///< Why there are no images.
  /// What is wrong with a file of the frame, be it that of the fault or a depth image that is left
  /// out, for people: "FILE: ..., expected ...". Empty: nothing.
  std::string warning = {};
};

/// What to take of an input, and how.
struct InputOptions {
  /// "euroc", "kitti", "tum", "replica", "images", "video", "bag"; empty: recognised.
  std::string format = {};
  std::optional<Setup> setup = {};         ///< Nothing: all that the input offers.
  std::size_t first = 0;                   ///< Index of the first frame used.
  std::optional<std::size_t> frames = {};  ///< At most so many frames.
  std::size_t every = 1;                   ///< Of the frames from first on, each n-th one.
  /// Images of camera 1 where the input is one folder of images, or one video, per camera.
  std::filesystem::path right = {};
  /// What is read where the path is "-": a line per image, "PATH" or "SECONDS PATH".
  std::optional<std::string> image_list = {};
  /// Two cameras in each picture, or in two tracks of a video; nothing: found by the sizes in the
  /// calibration, without one by what the pictures show.
  std::optional<Split> split = {};
  /// Image files to read, whatever the path is; empty: what the path holds.
  std::vector<std::filesystem::path> images = {};
  /// Depth images of a folder of images, by name or order; empty: none.
  std::filesystem::path depth = {};
  std::optional<double> fps = {};  ///< Frames per second where nothing tells their times.
  /// Width that images of camera 0 are made smaller to, and all else with them: see
  /// resize_input().
  std::optional<int> resize_px = {};
  /// Without such a width, images that are small for features come larger: see enlarge_if_small().
  bool enlarges_small = false;
  std::optional<int> rotate_deg = {};  ///< See rotate_input(), which comes before.
  /// One image, a folder with one per frame by name or order, or a video; empty: none.
  std::filesystem::path mask = {};
  bool has_jpeg = false;        ///< Frames come with a JPEG file, too.
  bool has_right_jpeg = false;  ///< And with one of camera 1.
  bool has_names = false;       ///< Frames of image files come with the name of theirs.
  /// Of a bag: the images of camera 0, and those of camera 1 or the depth; empty: found.
  std::vector<std::string> topics = {};
  /// Of a bag; nothing: those of the headers, unless their clock was set back.
  std::optional<BagTimes> times = {};
  /// Calibration from settings; takes the place of the one the data set carries.
  std::optional<CameraChain> calibration = {};
  /// Inertial data: a table (read_imu_file()), or "none"; empty: what the input carries.
  std::filesystem::path imu = {};
  /// What settings say of the IMU; takes the place, part by part, of what the input knows.
  ImuCalibration imu_calibration = {};
};

/// What of a recording is imperfect, which is made the best of.
struct InputCounts {
  /// Frames left out as they are not later than another: their times are double or out of order.
  std::size_t out_of_order = 0;
  /// Frames of which camera 0 alone is used: there is no image of camera 1, or no depth.
  std::size_t without_partner = 0;
  /// Frames that a video has less than its container states, known at its end.
  std::size_t missing_at_end = 0;
};

/// A topic of a bag.
struct TopicInfo {
  std::string name;              ///< "/camera/image_raw".
  std::string type;              ///< As ROS 1 writes it, "sensor_msgs/Image".
  std::size_t num_messages = 0;  ///< In all files.
  bool is_used = false;          ///< By the frames.
};

/// What was understood of an input.
struct InputInfo {
  std::string format;          ///< As in InputOptions.
  Setup setup = Setup::kMono;  ///< In use.
  /// Frames that next() will give; nothing when a video does not say.
  std::optional<std::size_t> num_frames;
  /// One camera per image of a frame: from the options, else from the data set, else nothing.
  std::optional<CameraChain> calibration;
  bool is_live = false;                ///< A camera: frames come when they come.
  int width_px = 0;                    ///< Of the images of camera 0.
  int height_px = 0;                   ///< Of the images of camera 0.
  int enlargement = 1;                 ///< How many times larger images are than in their files.
  InputCounts counts = {};             ///< Of the whole input, before --first, --every.
  std::vector<TopicInfo> topics = {};  ///< Of a bag.
  std::vector<std::int64_t> times_ns = {};    ///< Of all frames, where that is known.
  std::shared_ptr<const ImuStream> imu = {};  ///< Inertial data (input/imu_stream.h); null: none.
  bool has_times = true;  ///< Times are stated somewhere, rather than made up from the order.
  std::vector<std::string> lines;  ///< The same in words, for people.
};

/// A recorded input, read frame after frame. For one thread.
class Input {
 public:
  /// Decodes the images of a frame, in any thread, while the input goes on.
  using Decoding = std::function<InputFrame()>;

  virtual ~Input() = default;
  /// What was understood when it was opened.
  virtual const InputInfo& info() const = 0;
  /// The next frame, or nothing at the end. A bad image is a fault of its frame, never an
  /// exception.
  virtual std::optional<InputFrame> next() = 0;

  /// A calibration of the images that come out as one of those that are read, before --rotate and
  /// --resize, which InputOptions and files state. Throws InputError where it cannot be turned
  /// back.
  virtual CameraChain of_unchanged_images(CameraChain chain) const { return chain; }

  /// Whether other threads may decode: next_decoding() and complete() take the place of next().
  virtual bool can_decode_apart() const { return false; }
  /// next() in parts: what of the next frame can be done by another thread, or nothing at the end.
  /// Leaves info() as it is.
  virtual std::optional<Decoding> next_decoding() { return as_decoding(next()); }
  /// The rest, of each frame in turn, by the thread that asks for info().
  virtual void complete(InputFrame&) {}

 protected:
  /// One that has been decoded.
  static std::optional<Decoding> as_decoding(std::optional<InputFrame> frame);
};

/// Whether a path means a camera: camera:N, a device such as /dev/video0, or the address of a
/// stream (rtsp://HOST/PATH; of http:// those that do not end as the name of a video does).
bool is_camera(const std::filesystem::path& path);

/// Whether a path has the name of an image file.
bool is_image_name(const std::filesystem::path& path);

/// Recognises what path holds and opens it: a folder in the layout of EuRoC / TUM-VI, KITTI
/// odometry or TUM RGB-D, a folder of images, a video file, a folder that holds one video or
/// images/, a bag of ROS, the address of a video (http://...), a list of images ("-"), or a camera
/// (its frames have no end; their times are those of their arrival). Reads the first image. Throws
/// InputError that names the file (and line) for what is missing or malformed, and for a first
/// image that contradicts the calibration.
///
/// Times that are not later than the one before are left out up to a tenth of the input, and frames
/// that lack the image of camera 1 or the depth are used without: InputInfo::counts.
std::unique_ptr<Input> open_input(const std::filesystem::path& path, const InputOptions& options);

}  // namespace waymark
