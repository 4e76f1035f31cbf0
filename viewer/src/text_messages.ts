// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

import type { KeyframeImage } from "./protocol";

/** Text messages of docs/viewer-protocol.md. */

export type Control = "pause" | "resume" | "reset" | "save" | "mapping" | "stop" | "scale";
export type Phase = "starting" | "running" | "paused" | "finishing" | "done" | "map";

export interface Hello {
  type: "hello";
  protocol: number;
  program: string;
  mode: "live" | "map";
  input: string;
  setup: string;
  timing: string;
  controls: Control[];
  /** Whether images of keyframes can be asked for. */
  keyframe_images?: boolean;
  stages: string[];
  states: string[];
  reasons: string[];
}

export interface Status {
  type: "status";
  phase: Phase;
  /** What is done before the first image, such as finding the calibration; or empty. */
  doing: string;
  is_mapping: boolean;
  frame: number;
  time_s: number;
  state: string;
  reason: string;
  submap: number;
  matches: number;
  inliers: number;
  stages_ms: number[];
  tracking_ms: number;
  tracking_ms_median: number;
  frames: number;
  frames_total: number | null;
  tracked: number;
  unreadable: number;
  dropped: number;
  lost_count: number;
  keyframes: number;
  landmarks: number;
  submaps: number;
  loops: number;
  frames_per_s: number;
  calibration: CalibrationChange[];
  clients: number;
  /** Not there in a session without one, nor from older programs. */
  imu?: ImuStatus;
}

/** What an IMU measures beside the camera, and tells of the map. */
export interface ImuStatus {
  rate_hz: number | null;
  is_used: boolean;
  /** Why it is not used; empty: it was not compared with the images yet. */
  reason: string;
  submap: number | null;
  /** In metres since the IMU told these, whatever the message of sub-maps says. */
  metric_submap: number | null;
  /** Unit vector in the frame of the sub-map. */
  gravity: number[] | null;
  velocity_m_s: number[] | null;
}

/** A number of the calibration that the images changed; in px or rad, or without a unit. */
export interface CalibrationChange {
  name: string;
  given: number;
  change: number;
  sigma: number;
}

export interface Reply {
  type: "reply";
  request: number | null;
  ok: boolean;
  error?: string;
  path?: string;
}

export interface KeyframeData {
  type: "keyframe";
  request: number;
  id: number;
  frame: number;
  timestamp_ns: string;
  submap: number;
  position: number[];
  rotation: number[];
  parent: number | null;
  features: number;
  camera: string;
  covisible: [number, number][];
  landmarks: number[];
}

export interface LandmarkData {
  type: "landmark";
  request: number;
  id: number;
  submap: number;
  position: number[];
  reference: number;
  num_visible: number;
  num_found: number;
  observations: { keyframe: number; pixel: [number, number]; camera: number; error_px: number }[];
}

export type TextMessage = Hello | Status | Reply | KeyframeData | LandmarkData;
export type Answer = Reply | KeyframeData | LandmarkData | ({ type: "image" } & KeyframeImage);
