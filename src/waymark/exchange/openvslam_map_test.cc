// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/openvslam_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "waymark/base/check.h"
#include "waymark/exchange/testing/openvslam_document.h"

namespace waymark {
namespace {

using testing::Document;
using testing::SmallMap;

ImportedMap import(const SmallMap& small) {
  ImportedMap imported = import_openvslam_map(small.bytes(), "map.msg");
  EXPECT_EQ(imported.map.broken_invariants(), "");
  return imported;
}

/// Each landmark shows where it is by every feature that sees it, with its W and as a pixel.
void expect_no_residuals(const Map& map) {
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Features& features = *keyframe.features;
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (!keyframe.landmarks[i].is_valid()) continue;
      const Keypoint& keypoint = features.keypoints[i];
      const RigCamera& camera = keyframe.rig->cameras.at(keypoint.camera);
      const Eigen::Vector3d point = camera.cam_from_rig * keyframe.rig_from_world *
                                    map.landmarks().at(keyframe.landmarks[i]).position_in_world;
      EXPECT_LT((features.bearings[i].cast<double>() - point.normalized()).norm(), 1e-5);
      Eigen::Vector2d pixel;
      std::uint8_t is_visible = 0;
      camera.camera->project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
      EXPECT_TRUE(is_visible);
      EXPECT_LT((Eigen::Vector2d(keypoint.x_px, keypoint.y_px) - pixel).norm(), 1e-2);
      EXPECT_GT(features.size_rad[i], 0.0f);
    }
  });
}

TEST(OpenvslamMap, HoldsWhatTheFileHolds) {
  SmallMap small = testing::make_small_map();
  const ImportedMap imported = import(small);
  const Map& map = imported.map;
  EXPECT_THAT(imported.notes, ::testing::IsEmpty());
  ASSERT_EQ(map.keyframes().size(), 3u);
  ASSERT_EQ(map.landmarks().size(), small.points.size());
  ASSERT_EQ(map.submaps().size(), 1u);
  EXPECT_FALSE(map.submaps()[0].is_metric);
  expect_no_residuals(map);

  const Keyframe& last = map.keyframes().at(KeyframeId{2});
  EXPECT_EQ(last.parent, KeyframeId{1});
  EXPECT_EQ(last.timestamp_ns, 102'500'000'000);
  EXPECT_EQ(last.frame, FrameId{2});
  EXPECT_LT((last.rig_from_world.translation - small.cam_from_world[2].translation).norm(), 1e-9);
  EXPECT_EQ(last.features->size(), 31u);
  EXPECT_FALSE(last.landmarks[30].is_valid());
  EXPECT_EQ(last.features->keypoints[11].level, 3);
  EXPECT_NEAR(last.features->keypoints[11].angle_rad, -M_PI / 2.0, 1e-6);
  const Document& words = small.keyframe(2)["descs"][4];
  EXPECT_EQ(last.features->descriptors[4][1],
            words[2].get<std::uint64_t>() | words[3].get<std::uint64_t>() << 32);

  const Landmark& landmark = map.landmarks().at(LandmarkId{7});
  EXPECT_EQ(landmark.reference, KeyframeId{1});
  EXPECT_EQ(landmark.num_visible, 9u);
  EXPECT_EQ(landmark.num_found, 5u);
  EXPECT_EQ(landmark.observations.size(), 3u);
  EXPECT_GT(landmark.appearance.size_m, 0.0);
  const std::vector<LoopEdge> edges = map.loop_edges();
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_EQ(edges[0].from, KeyframeId{0});
  EXPECT_EQ(edges[0].to, KeyframeId{2});
  EXPECT_LT((edges[0].to_from_from.translation - last.rig_from_world.translation).norm(), 1e-9);
}

TEST(OpenvslamMap, ReadsTheOlderKeys) {
  SmallMap small = testing::make_small_map();
  small.document.erase("orb_params");
  small.document.erase("keyframe_next_id");
  small.document["frame_next_id"] = 90;
  for (int id = 0; id < 3; ++id) {
    Document& keyframe = small.keyframe(id);
    keyframe.erase("orb_params");
    keyframe["src_frm_id"] = 30 * id;
    keyframe["depth_thr"] = 40.0;
    keyframe["keypts"] = keyframe["undist_keypts"];
    keyframe["n_scale_levels"] = 8;
    keyframe["scale_factor"] = 1.44;  // Two of our levels each.
  }
  small.keyframe(0)["span_parent"] = -1;
  const ImportedMap imported = import(small);
  expect_no_residuals(imported.map);
  const Features& features = *imported.map.keyframes().at(KeyframeId{0}).features;
  EXPECT_EQ(features.keypoints[11].level, 6);
  EXPECT_EQ(features.keypoints[7].level, 7);  // No coarser one here.
}

TEST(OpenvslamMap, StereoKeepsRightColumnsAndRanges) {
  Document camera = testing::perspective_document();
  camera["setup_type"] = "Stereo";
  camera["focal_x_baseline"] = 40.0;
  SmallMap small = testing::make_small_map(camera);
  for (int id = 0; id < 3; ++id) {
    Document& keyframe = small.keyframe(id);
    for (std::size_t i = 0; i < small.points.size(); ++i) {
      const double z = (small.cam_from_world[id] * small.points[i]).z();
      const double x = keyframe["undist_keypts"][i]["pt"][0];
      keyframe["x_rights"].push_back(i == 3 ? -1.0 : x - 40.0 / z);
      keyframe["depths"].push_back(i == 3 ? -1.0 : z);
    }
    keyframe["x_rights"].push_back(-1.0);
    keyframe["depths"].push_back(-1.0);
  }
  const ImportedMap imported = import(small);
  expect_no_residuals(imported.map);
  EXPECT_TRUE(imported.map.submaps()[0].is_metric);
  const Keyframe& keyframe = imported.map.keyframes().at(KeyframeId{1});
  const Features& features = *keyframe.features;
  EXPECT_EQ(features.num_primary, 31u);
  EXPECT_EQ(features.partner[3], kNoFeature);
  EXPECT_EQ(features.range_m[3], 0.0f);
  ASSERT_NE(features.partner[4], kNoFeature);
  EXPECT_TRUE(keyframe.landmarks[4].is_valid());
  EXPECT_NEAR(features.range_m[4], (small.cam_from_world[1] * small.points[4]).norm(), 1e-3);
}

TEST(OpenvslamMap, KnowsTheOtherCameras) {
  Document fisheye = testing::perspective_document();
  fisheye["model_type"] = "Fisheye";
  fisheye["k4"] = 0.001;
  fisheye["setup_type"] = "RGBD";
  Document division = testing::perspective_document();
  division["model_type"] = "RadialDivision";
  division["distortion"] = -0.1;
  const Document around = {{"model_type", "Equirectangular"},
                           {"setup_type", "Monocular"},
                           {"cols", 1280},
                           {"rows", 640}};
  for (const Document& camera : {fisheye, division, around}) {
    const ImportedMap imported = import(testing::make_small_map(camera));
    EXPECT_EQ(imported.map.keyframes().at(KeyframeId{1}).features->size(), 31u);
    expect_no_residuals(imported.map);
  }
}

TEST(OpenvslamMap, LeavesOutWhatLeadsNowhere) {
  SmallMap small = testing::make_small_map();
  small.document["landmarks"].erase("5");
  small.keyframe(1)["lm_ids"][8] = 7;
  small.keyframe(1)["loop_edges"] = {77};
  small.keyframe(2)["undist_keypts"][9]["pt"] = {-9000.0, 0.0};
  small.document["landmarks"]["99"] = small.document["landmarks"]["4"];
  small.document["landmarks"]["6"]["ref_keyfrm"] = 1234;
  const ImportedMap imported = import(small);
  EXPECT_EQ(imported.map.landmarks().size(), 29u);
  EXPECT_EQ(imported.map.keyframes().at(KeyframeId{2}).features->size(), 30u);
  EXPECT_THAT(imported.notes, ::testing::SizeIs(5));
}

TEST(OpenvslamMap, MakesASubmapOfEachTree) {
  SmallMap small = testing::make_small_map();
  small.keyframe(0)["span_parent"] = 1;  // Children may be older than their parents.
  small.keyframe(1)["span_parent"] = -1;
  small.keyframe(2)["span_parent"] = -1;
  const ImportedMap imported = import(small);
  EXPECT_EQ(imported.map.submaps().size(), 2u);
  EXPECT_EQ(imported.map.keyframes().size(), 3u);
}

struct Damage {
  const char* words;
  std::function<void(SmallMap&)> inflict;
};

TEST(OpenvslamMap, NamesWhatIsWrong) {
  const std::vector<Damage> damages = {
      {"keyframes", [](SmallMap& m) { m.document.erase("keyframes"); }},
      {"no keyframes", [](SmallMap& m) { m.document["keyframes"] = Document::object(); }},
      {"is an array, expected a map", [](SmallMap& m) { m.document["landmarks"] = {1}; }},
      {"landmarks.x", [](SmallMap& m) { m.document["landmarks"]["x"] = {1}; }},
      {"has no rot_cw", [](SmallMap& m) { m.keyframe(1).erase("rot_cw"); }},
      {"rot_cw",
       [](SmallMap& m) {
         m.keyframe(1)["rot_cw"] = {0.0, 0.0, 0.0, 0.5};
       }},
      {"trans_cw",
       [](SmallMap& m) {
         m.keyframe(1)["trans_cw"] = {0.0, 0.0};
       }},
      {"keyframes.1.trans_cw[2]",
       [](SmallMap& m) {
         m.keyframe(1)["trans_cw"][2] = std::numeric_limits<double>::quiet_NaN();
       }},
      {"pos_w[0]", [](SmallMap& m) { m.document["landmarks"]["3"]["pos_w"][0] = 1e300; }},
      {"ts", [](SmallMap& m) { m.keyframe(1)["ts"] = -1.0; }},
      {"undist_keypts[4].oct", [](SmallMap& m) { m.keyframe(1)["undist_keypts"][4]["oct"] = 8; }},
      {"undist_keypts[4]", [](SmallMap& m) { m.keyframe(1)["undist_keypts"][4]["oct"] = -1; }},
      {"undist_keypts[4].pt[1]",
       [](SmallMap& m) { m.keyframe(1)["undist_keypts"][4]["pt"][1] = "a"; }},
      {"descs", [](SmallMap& m) { m.keyframe(1)["descs"].erase(0); }},
      {"descs[2]", [](SmallMap& m) { m.keyframe(1)["descs"][2].push_back(1); }},
      {"descs[2][3]", [](SmallMap& m) { m.keyframe(1)["descs"][2][3] = 1ll << 32; }},
      {"lm_ids", [](SmallMap& m) { m.keyframe(1)["lm_ids"].push_back(1); }},
      {"depths", [](SmallMap& m) { m.keyframe(1)["depths"] = {1.0}; }},
      {"n_keypts", [](SmallMap& m) { m.keyframe(1)["n_keypts"] = 4000000000u; }},
      {"cam is 'lost'", [](SmallMap& m) { m.keyframe(1)["cam"] = "lost"; }},
      {"orb_params is 'lost'", [](SmallMap& m) { m.keyframe(1)["orb_params"] = "lost"; }},
      {"span_parent is 7", [](SmallMap& m) { m.keyframe(1)["span_parent"] = 7; }},
      {"circle", [](SmallMap& m) { m.keyframe(0)["span_parent"] = 2; }},
      {"model 'Square'",
       [](SmallMap& m) { m.document["cameras"]["cam"]["model_type"] = "Square"; }},
      {"has no fx", [](SmallMap& m) { m.document["cameras"]["cam"].erase("fx"); }},
      {"cols is", [](SmallMap& m) { m.document["cameras"]["cam"]["cols"] = 1e6; }},
      {"num_levels", [](SmallMap& m) { m.document["orb_params"]["orb"]["num_levels"] = 1000; }},
      {"scale_factor", [](SmallMap& m) { m.document["orb_params"]["orb"]["scale_factor"] = 1; }},
      {"outside the images", [](SmallMap& m) { m.document["cameras"]["cam"]["cx"] = 4000.0; }},
  };
  for (const Damage& damage : damages) {
    SmallMap small = testing::make_small_map();
    damage.inflict(small);
    try {
      import_openvslam_map(small.bytes(), "map.msg");
      ADD_FAILURE() << "no error for " << damage.words;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith("map.msg: "));
      EXPECT_THAT(error.what(), ::testing::HasSubstr(damage.words));
      EXPECT_THAT(error.what(), ::testing::Not(::testing::HasSubstr("\n")));
    }
  }
}

TEST(OpenvslamMap, SurvivesTruncationAndFlippedBytes) {
  const std::string whole = testing::make_small_map().bytes();
  for (std::size_t size = 0; size < whole.size(); size += 97) {
    EXPECT_THROW(import_openvslam_map(whole.substr(0, size), "map.msg"), InputError);
  }
  EXPECT_THROW(import_openvslam_map(whole + "x", "map.msg"), InputError);
  Rng rng(5, 0);
  for (int round = 0; round < 300; ++round) {
    std::string damaged = whole;
    for (int i = 0; i < 3; ++i) damaged[rng.below(whole.size())] = static_cast<char>(rng.next());
    try {
      EXPECT_EQ(import_openvslam_map(damaged, "map.msg").map.broken_invariants(), "");
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace waymark
