// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Status } from "../text_messages";

/** What states and reasons of the protocol are called here, and what one can do about them. */

export const STATE_WORDS: Record<string, string> = {
  initializing: "Finding a start",
  tracked: "Tracking",
  filled: "Found afterwards",
  lost: "Lost",
  unreadable: "Unreadable image",
  dropped: "Dropped",
};

export const REASON_WORDS: Record<string, string> = {
  none: "",
  no_features: "nothing to see in the image",
  too_little_parallax: "the camera has hardly moved sideways",
  too_few_matches: "too little of the map is in sight",
  too_few_inliers: "what is seen does not fit the map",
  no_candidate: "no place looks like this one",
  not_verified: "no place fits this image",
  unreadable_image: "the image cannot be read",
  wrong_size: "the image has another size",
  late: "the image came too late",
};

export const ADVICE: Record<string, string> = {
  none: "Move the camera slowly, sideways rather than turning.",
  no_features: "The image shows too little: more light, or something with more texture, will help.",
  too_little_parallax: "Move the camera sideways: a map starts once the same things were seen from two places.",
  too_few_matches: "Move more slowly, and keep in view what was there a moment ago.",
};

/** Custom property of the colour of a state. */
export const STATE_COLOURS: Record<string, string> = {
  initializing: "--starting", tracked: "--tracked", filled: "--filled", lost: "--lost", unreadable: "--lost", dropped: "--lost",
};

export const PHASE_WORDS: Record<string, string> = {
  starting: "Starting", paused: "Paused", finishing: "Finishing", done: "Finished", map: "Saved map",
};

export const STAGE_WORDS: Record<string, string> = { local_map: "local map", wait: "waiting", initialize: "start", recover: "recovery" };

/** The session came to its end, after which the program takes its leave. */
export function isOver(status: Status | null): boolean {
  return status?.phase === "done";
}
