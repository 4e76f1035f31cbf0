// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the images told of a calibration, and the numbers of a rig as one vector.
//
//   for (const CalibrationEstimate& number : system.calibration()) {
//     std::cout << number.name << " " << number.given + number.change << " +- " << number.sigma <<
//     "\n";
//   }
//   const CalibrationParameters parameters(rig);
//   const std::optional<Rig> same = parameters.rig_at(Eigen::VectorXd::Zero(parameters.size()));

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/camchain.h"
#include "waymark/camera/rig.h"

namespace waymark {

/// What a number of a calibration is about.
enum class CalibrationGroup {
  kFocalLength,
  kCentre,       ///< The principal point.
  kRadial,       ///< Distortion along the radius, and the shape of wide models.
  kTangential,   ///< Distortion across it.
  kAlong,        ///< What bearings of a pair are off by along epipolar lines.
  kAcross,       ///< The same across them.
  kReadout,      ///< How long a rolling shutter takes for all rows.
  kDepthOffset,  ///< What inverse depths are too large by.
  kExtrinsics,   ///< Turns of a camera and of its baseline.
};

/// One number of a calibration that images can tell more of.
struct CalibrationParameter {
  std::string name;    ///< For example "cam0.fu", "cam1.turn_y", "readout_ms".
  double given = 0.0;  ///< As the calibration says; 0 for turns, which count from it.
  CalibrationGroup group = CalibrationGroup::kFocalLength;  ///< What it is about.
  /// How far the truth may lie from that, in its unit (px, rad, 1, ms, 1/m); 0: it is exact.
  double prior_sigma = 0.0;
  double usual_sigma = 0.0;  ///< The same of calibrations in general.
  /// What images tell of it is off by as much, however many they are: by errors of matching that
  /// last, such as those of slanted surfaces, and by what no model has. 0: of what is held.
  double systematic_sigma = 0.0;
};

/// What the images told of one number of a calibration.
struct CalibrationEstimate {
  std::string name;          ///< For example "cam0.k1", "cam1.turn_y".
  double given = 0.0;        ///< As the calibration says, px, rad, 1, ms or 1/m.
  double change = 0.0;       ///< Of the value in use from the one given.
  double given_sigma = 0.0;  ///< Standard deviation that was assumed of what was given.
  double sigma = 0.0;        ///< The same of the value in use.

  /// Whether the images contradict what was given.
  bool is_changed() const { return std::abs(change) > 3.0 * sigma; }
};

/// The numbers of a rig as one vector: per camera the intrinsics and the distortion; of each camera
/// but the first its BearingError (10, rad); the readout (1, ms, the same in all cameras); of a
/// single camera the offset of its depth image, if it has one (1, 1/m); of each camera but the
/// first its turn about its own centre (3, rad) and that of the baseline across itself (2, rad),
/// whose length is the unit of all lengths and cannot be told. Cameras that cannot be made anew
/// (RigCamera::remake) and those of 360 degree images have no numbers of their projection; a rig of
/// one of these has none at all.
class CalibrationParameters {
 public:
  /// Where the parameters of a camera are.
  struct Block {
    std::size_t first = 0;           ///< Its index in list().
    std::size_t num_projection = 0;  ///< Of the projection, with distortion: these come first.
    /// All that move a pixel or a depth without moving the camera.
    std::size_t num_intrinsics = 0;
    bool has_extrinsics = false;  ///< Whether five more follow.
    /// How many there are.
    std::size_t size() const { return num_intrinsics + (has_extrinsics ? 5 : 0); }
  };

  /// given: the rig as calibrated, from which all changes count. A pinhole camera without
  /// distortion gets that of radtan, at zero.
  explicit CalibrationParameters(const Rig& given);

  /// All of them, in order.
  const std::vector<CalibrationParameter>& list() const { return list_; }
  /// How many there are.
  std::size_t size() const { return list_.size(); }
  /// Per camera.
  const std::vector<Block>& blocks() const { return blocks_; }
  /// Inverse covariance of the change from what was given, for these standard deviations of each
  /// parameter; those with 0 are held.
  Eigen::MatrixXd prior_information(const std::vector<double>& sigmas) const;

  /// Standard deviations in the order of list(), per camera as its calibration carries them.
  std::vector<CalibrationSigmas> by_camera(const std::vector<double>& sigmas) const;

  /// Where the first parameter of a group is; nothing where there is none.
  std::optional<std::size_t> find(CalibrationGroup group) const;

  /// The rig whose parameters differ by `change` from what was given; nothing where there is no
  /// such camera.
  std::optional<Rig> rig_at(const Eigen::VectorXd& change) const;

  /// Derivatives of the pixels of unit bearings in one camera by its intrinsics, at `change`; px
  /// per unit of each parameter. By central differences, of any model. Per bearing 2 x
  /// num_intrinsics, column by column; zero where it does not project, and by the readout, which
  /// takes a motion, too. Nothing where there is no such camera.
  std::optional<std::vector<double>> pixel_by_intrinsics(
      std::size_t camera,
      const Eigen::VectorXd& change,
      std::span<const Eigen::Vector3d> bearings) const;

 private:
  void add(CalibrationParameter parameter, const std::vector<double>& sigmas, std::size_t i);
  void add_projection(std::size_t camera);
  void add_bearing_error(std::size_t camera);
  void add_sensor(std::size_t camera);
  void add_extrinsics(std::size_t camera);
  void differentiate_by_bearing_error(std::size_t camera,
                                      std::span<const Eigen::Vector3d> bearings,
                                      std::vector<double>& derivatives) const;
  void tie_alike();
  std::vector<std::size_t> find(std::string_view ending) const;
  void tie(std::size_t a, std::size_t b, double ratio, double sigma);
  CameraDescription description_at(std::size_t camera, const Eigen::VectorXd& change) const;

  Rig given_;
  std::vector<CalibrationParameter> list_;
  std::vector<Block> blocks_;
  Eigen::MatrixXd ties_;  ///< What is known of differences between parameters, as information.
};

/// The calibration of a rig with its standard deviations, for a file. estimates: of all parameters
/// of the rig, which is measured with them; empty: it is as sure as it says. Nothing where a camera
/// has no description.
std::optional<CameraChain> chain_of(const Rig& rig, std::span<const CalibrationEstimate> estimates);

/// Derivatives of the pixels of unit bearings by angles along the epipolar lines of camera 0,
/// towards near points, and across them, px per rad; zero where a bearing does not project.
std::vector<Eigen::Matrix2d> pixel_by_epipolar_angles(const RigCamera& camera,
                                                      std::span<const Eigen::Vector3d> bearings);

/// Two unit vectors across a baseline, as columns: the directions in which it may turn.
Eigen::Matrix<double, 3, 2> across_baseline(const Eigen::Vector3d& baseline);

/// cam_from_rig of a camera that was turned about its centre, left of it, and whose baseline was
/// turned by small angles along the columns of across_baseline(). `turns` has 5 entries, in rad.
Rigid3 turned(const Rigid3& cam_from_rig, const Eigen::Matrix<double, 5, 1>& turns);

}  // namespace waymark
