// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Kind, NONE, type Cameras, type Frame, type Markers, type Message, type Submaps } from "../protocol";
import { KeyframeTable } from "./keyframe_table";
import { LandmarkTable } from "./landmark_table";
import { TrajectoryTable } from "./trajectory_table";

/** What the page knows of the map: the sum of all messages since the last `begin`. */
export class Store {
  readonly landmarks = new LandmarkTable();
  readonly keyframes = new KeyframeTable();
  readonly trajectory = new TrajectoryTable();
  cameras: Cameras | null = null;
  camerasVersion = 0;
  submaps: Submaps | null = null;
  markers: Markers | null = null;
  frame: Frame | null = null;
  generation = 0;
  /** True between `begin` and `end`. */
  isLoading = false;
  /** Landmarks that `begin` promised. */
  expectedLandmarks = 0;
  /** Goes up with every message that changes the map. */
  version = 0;

  apply(m: Message): void {
    ++this.version;
    switch (m.kind) {
      case Kind.Begin: return this.begin(m.generation, m.landmarks, m.keyframes, m.frames);
      case Kind.End: this.isLoading = false; return;
      case Kind.Landmarks: return this.landmarks.upsert(m);
      case Kind.LandmarkPositions: return this.landmarks.moveAll(m);
      case Kind.LandmarksErased: return this.landmarks.erase(m);
      case Kind.Cameras:
        this.cameras = m;
        ++this.camerasVersion;
        return;
      case Kind.Keyframes: return this.keyframes.upsert(m);
      case Kind.KeyframePoses: return this.keyframes.moveAll(m);
      case Kind.KeyframesErased: return this.keyframes.erase(m);
      case Kind.Covisibility: return this.keyframes.setCovisibility(m);
      case Kind.Loops: return this.keyframes.setLoops(m.from, m.to);
      case Kind.Trajectory: return this.trajectory.upsert(m);
      case Kind.Frame: this.frame = m; return;
      case Kind.Submaps: this.submaps = m; return;
      case Kind.Markers: this.markers = m; return;
      case Kind.EdgePoints: return this.landmarks.setEdges(m);
      case Kind.KeyframeImage: return; // An answer, no part of the map.
    }
  }

  /** The part that a sub-map belongs to: itself, or what it was joined into in the end. */
  rootOf(submap: number): number {
    const joined = this.submaps?.joined_into;
    let steps = joined?.length ?? 0;
    while (joined && steps-- > 0 && (joined[submap] ?? NONE) !== NONE) submap = joined[submap]!;
    return submap;
  }

  private begin(generation: number, landmarks: number, keyframes: number, frames: number): void {
    this.landmarks.clear();
    this.keyframes.clear();
    this.trajectory.clear();
    this.cameras = null;
    ++this.camerasVersion;
    this.submaps = null;
    this.markers = null;
    this.landmarks.reserve(Math.min(landmarks, 1 << 24));
    this.keyframes.reserve(Math.min(keyframes, 1 << 20));
    this.trajectory.reserve(Math.min(frames, 1 << 22));
    this.expectedLandmarks = landmarks;
    this.generation = generation;
    this.isLoading = true;
  }
}
