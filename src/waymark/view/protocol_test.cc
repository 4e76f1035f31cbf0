// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "waymark/view/hub.h"
#include "waymark/view/message.h"
#include "waymark/view/testing/messages.h"

namespace waymark {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// The worked examples of docs/viewer-protocol.md, by kind.
std::map<int, std::string> documented_examples() {
  std::ifstream file(WAYMARK_PROTOCOL_DOCUMENT);
  std::stringstream text;
  text << file.rdbuf();
  const std::string content = text.str();
  static const std::regex kExample("`([0-9a-f]{2} 01 0000 [0-9a-f \\n]+)`");
  std::map<int, std::string> examples;
  for (std::sregex_iterator it(content.begin(), content.end(), kExample), end; it != end; ++it) {
    std::string digits = (*it)[1].str();
    std::erase_if(digits, [](char c) { return !std::isxdigit(static_cast<unsigned char>(c)); });
    std::string bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
      bytes.push_back(static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16)));
    }
    examples[bytes[0]] = bytes;
  }
  return examples;
}

TEST(Protocol, TheDocumentedExamplesAreMessages) {
  const std::map<int, std::string> examples = documented_examples();
  ASSERT_EQ(examples.size(), 17u);
  Page page;
  for (const auto& [kind, bytes] : examples) {
    if (kind == 13 || kind == 17) continue;
    if (kind == 4) page.landmarks[7].resize(10);
    if (kind == 8) page.keyframes[2].resize(13);
    page.apply(std::make_shared<const std::string>(bytes));
  }
  EXPECT_THAT(page.landmarks.count(7), 0);  // The example of kind 5 erases it.
  EXPECT_EQ(page.edges.at(3).back(), std::pair(2u, 70));
  EXPECT_THAT(page.frames.at(10), ::testing::ElementsAre(1, 0, 0, 0, 0, 0, 1, 0.5, 12.5, 0, 1, 0));
}

TEST(Protocol, AFrameIsWhatTheDocumentSays) {
  auto features = std::make_shared<Features>();
  features->num_primary = 1;
  features->keypoints.push_back({.x_px = 100.0f, .y_px = 50.0f});
  DrawnFrame frame;
  frame.frame = FrameId{10};
  frame.timestamp_ns = 1'500'000'000;
  frame.width_px = 640;
  frame.height_px = 480;
  frame.features = features;
  frame.landmarks = {LandmarkId{3}};
  EXPECT_EQ(*encode_frame(frame, 1'000'000'000), documented_examples().at(13));
}

TEST(Protocol, AnImageOfAKeyframeIsWhatTheDocumentSays) {
  auto features = std::make_shared<Features>();
  features->num_primary = 1;
  features->keypoints.push_back({.x_px = 100.0f, .y_px = 50.0f});
  CameraChain chain;
  chain.cameras.emplace_back();
  CameraDescription& camera = chain.cameras[0].description;
  camera.camera_model = "pinhole";
  camera.intrinsics = {300.0, 300.0, 320.0, 240.0};
  camera.width_px = 640;
  camera.height_px = 480;
  features->rig = std::make_shared<const Rig>(make_rig(chain));
  Keyframe keyframe;
  keyframe.features = features;
  keyframe.landmarks = {LandmarkId{3}};
  EXPECT_EQ(*encode_keyframe_image(keyframe, KeyframeId{2}, 6, "\xff\xd8\xff\xd9"),
            documented_examples().at(17));
}

TEST(Protocol, PreviewsAreSmallJpegFiles) {
  Image image(1280, 640);
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    image.values[i] = static_cast<std::uint8_t>(i / 1280);
  }
  const std::string jpeg = encode_preview(image);
  EXPECT_TRUE(jpeg.starts_with("\xff\xd8"));
  EXPECT_LT(jpeg.size(), 60000u);
  EXPECT_EQ(encode_preview(Image()), "");
}

TEST(Protocol, ReadsRequests) {
  const auto kind = [](const char* text) {
    return std::get<ViewRequest::Kind>(parse_request(text).content);
  };
  EXPECT_EQ(kind(R"({"request": 1, "do": "pause"})"), ViewRequest::Kind::kPause);
  EXPECT_EQ(kind(R"({"request": 1, "do": "mapping", "on": false})"),
            ViewRequest::Kind::kMappingOff);
  EXPECT_EQ(kind(R"({"do": "stop", "request": 0})"), ViewRequest::Kind::kStop);
  const ClientRequest show = parse_request(R"({"request": 9, "do": "landmark", "id": 17})");
  EXPECT_EQ(show.number, 9u);
  EXPECT_EQ(std::get<LandmarkId>(show.content), LandmarkId{17});
  EXPECT_EQ(
      std::get<SetRate>(parse_request(R"({"request": 1, "do": "rate", "hz": 2.5})").content).hz,
      2.5);
}

TEST(Protocol, ReadsADistanceOfAnyTwoPlaces) {
  const ClientRequest scale = parse_request(
      R"({"request": 1, "do": "scale", "a": {"keyframe": 3}, "b": {"landmark": 9}, "metres": 2.5})");
  const auto& distance = std::get<KnownDistance>(scale.content);
  EXPECT_EQ(std::get<KeyframeId>(distance.a), KeyframeId{3});
  EXPECT_EQ(std::get<LandmarkId>(distance.b), LandmarkId{9});
  EXPECT_EQ(distance.metres, 2.5);
  for (const char* more : {R"("a": {"keyframe": 3})",
                           R"("a": 3, "b": 4, "metres": 1)",
                           R"("a": {"keyframe": -3}, "b": {"keyframe": 4}, "metres": 1)",
                           R"("a": {"keyframe": 3}, "b": {"keyframe": 4}, "metres": "1")"}) {
    const auto text = std::string(R"({"request": 1, "do": "scale", )") + more + "}";
    EXPECT_TRUE(std::holds_alternative<std::string>(parse_request(text).content)) << text;
  }
}

TEST(Protocol, NamesWhatIsWrongWithARequest) {
  const auto error = [](const std::string& text) {
    return std::get<std::string>(parse_request(text).content);
  };
  EXPECT_THAT(error(""), HasSubstr("JSON object"));
  EXPECT_THAT(error("[1]"), HasSubstr("JSON object"));
  EXPECT_THAT(error(std::string(60000, '[')), HasSubstr("JSON object"));
  EXPECT_THAT(error("\xff\xfe{"), HasSubstr("JSON object"));
  EXPECT_THAT(error(R"({"do": "pause"})"), HasSubstr("request"));
  EXPECT_THAT(error(R"({"request": -1, "do": "pause"})"), HasSubstr("request"));
  EXPECT_THAT(error(R"({"request": 1e300, "do": "pause"})"), HasSubstr("request"));
  EXPECT_THAT(error(R"({"request": 1, "do": 7})"), HasSubstr("do:"));
  EXPECT_THAT(error(R"({"request": 1, "do": "format"})"), HasSubstr("not known"));
  EXPECT_THAT(error(R"({"request": 1, "do": "landmark", "id": 4294967295})"), HasSubstr("id:"));
  EXPECT_THAT(error(R"({"request": 1, "do": "rate", "hz": 1000})"), HasSubstr("hz:"));
  EXPECT_THAT(error(R"({"request": 1, "do": "mapping"})"), HasSubstr("on:"));
}

TEST(Protocol, TextsHaveWhatTheDocumentPromises) {
  SessionInfo info;
  info.program = "waymark";
  info.input = "caf\xe9";  // Not UTF-8.
  const json hello = json::parse(format_hello(info));
  EXPECT_EQ(hello["states"].size(), 6u);
  EXPECT_EQ(hello["states"][5], "dropped");
  EXPECT_EQ(hello["reasons"].size(), 10u);
  EXPECT_EQ(hello["reasons"][9], "late");
  EXPECT_EQ(hello["controls"].size(), 5u);
  SessionStatus now;
  now.calibration = {{"cam0.k1", -0.283, 2.5e-5, 1e-2, 3e-6}};
  const json status = json::parse(format_status(now, Map(), 3));
  EXPECT_EQ(status["phase"], "starting");
  EXPECT_EQ(status["frame"], nullptr);
  EXPECT_EQ(status["clients"], 3);
  EXPECT_EQ(
      status["calibration"],
      json::parse(R"([{"name": "cam0.k1", "given": -0.283, "change": 2.5e-5, "sigma": 3e-6}])"));
  EXPECT_FALSE(status.contains("imu")) << "this session has none";
  EXPECT_EQ(status["stages_ms"].size(), hello["stages"].size());
  const json reply = json::parse(format_keyframe(Map(), KeyframeId{3}, 5));
  EXPECT_EQ(reply["ok"], false);
  EXPECT_EQ(reply["request"], 5);
}

TEST(Protocol, AStatusTellsOfTheImuAsTheDocumentSays) {
  const auto told = [](const ImuStatus& imu) {
    SessionStatus now;
    now.imu = imu;
    return json::parse(format_status(now, Map(), 1)).at("imu");
  };
  ImuStatus imu = {.rate_hz = 200.0, .is_used = true, .submap = SubmapId{0}};
  imu.gravity = -Eigen::Vector3d::UnitZ();
  imu.velocity_m_s = Eigen::Vector3d(0.42, -0.1, 0.03);
  std::ifstream file(WAYMARK_PROTOCOL_DOCUMENT);
  std::string line;
  while (std::getline(file, line) && !line.starts_with("{\"imu\": ")) continue;
  EXPECT_EQ(told(imu), json::parse(line).at("imu"));
  const json left_out = told({.reason = "it always shows the same"});
  EXPECT_EQ(left_out["reason"], "it always shows the same");
  EXPECT_EQ(left_out["is_used"], false);
  for (const char* name : {"rate_hz", "submap", "metric_submap", "gravity", "velocity_m_s"}) {
    EXPECT_TRUE(left_out.at(name).is_null()) << name;
  }
}

}  // namespace
}  // namespace waymark
