// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/settings.h"

#include <gmock/gmock.h>

#include "waymark/track/keyframe_decision.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Settings, ConstantsOfTheStagesAreReadAsExperiments) {
  Settings settings;
  read_settings(settings,
                {ConfigSource::from_assignment("experiment.tracking.keyframes.max_pending=1"),
                 ConfigSource::from_assignment("experiment.mapping.window.max_fixed=2"),
                 ConfigSource::from_assignment("experiment.loop.verification.min_share=0.9")});
  const KeyframeSituation pending = {
      .num_reference = 100, .frames_since_keyframe = 9, .num_pending = 1};
  EXPECT_TRUE(should_make_keyframe(pending, Settings().tracking));
  EXPECT_FALSE(should_make_keyframe(pending, settings.tracking));
  EXPECT_EQ(settings.mapping.options.window.max_fixed, 2);
  EXPECT_EQ(settings.loop.options.verification.min_share, 0.9);
}

TEST(Settings, ExperimentsAreWrittenWhereTheyAreChanged) {
  EXPECT_THAT(settings_as_yaml(Settings()), Not(HasSubstr("experiment")));
  EXPECT_THAT(settings_as_markdown<Settings>(), Not(HasSubstr("experiment")));
  Settings settings;
  settings.tracking.options.keyframes.max_pending = 1;
  const std::string yaml = settings_as_yaml(settings);
  EXPECT_THAT(yaml, HasSubstr("\n    keyframes:\n"));
  EXPECT_THAT(yaml, Not(HasSubstr("min_known_near")));
  Settings again;
  read_settings(again, {ConfigSource{"written", yaml}});
  EXPECT_EQ(again.tracking.options.keyframes.max_pending, 1);
}

}  // namespace
}  // namespace waymark
