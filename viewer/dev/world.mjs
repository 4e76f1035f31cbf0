// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

// A made-up session for the mock server: a walk around a courtyard, or a large map that is there from the start.

export const NONE = 0xffffffff;
const RATE = 20;
const LAP_S = 60;

export function random(seed) {
  let state = seed >>> 0 || 1;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Where the camera is at a time, and where it looks: along a rounded square with a bay, slightly up and down. */
export function poseAt(time_s, size = 9) {
  const place = (t) => {
    const a = (2 * Math.PI * t) / LAP_S;
    const r = size * (1 + 0.18 * Math.cos(4 * a) + 0.1 * Math.sin(2 * a));
    return [r * Math.sin(a), 0.25 * Math.sin(5 * a) + 0.03 * Math.sin(14 * t), r * (1 - Math.cos(a))];
  };
  const [x, y, z] = place(time_s);
  const [x1, , z1] = place(time_s + 0.4);
  const yaw = Math.atan2(x1 - x, z1 - z);
  return { position: [x, y, z], rotation: [0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)], yaw };
}

/** A point on walls and floor around a pose. */
export function pointNear(pose, next) {
  const ahead = 0.5 + 3 * next();
  const side = next() < 0.5 ? -1 : 1;
  const isFloor = next() < 0.28;
  const isShelf = next() < 0.4;
  const across = isFloor ? 4 * next() - 2 : side * (isShelf ? 1.9 - 0.3 * next() : 2.2);
  const up = isFloor ? 1.5 : isShelf ? 1.4 - 0.7 * Math.floor(4 * next()) : 1.5 - 3 * next();
  const s = Math.sin(pose.yaw);
  const c = Math.cos(pose.yaw);
  const noise = () => 0.02 * (next() - 0.5);
  return [
    pose.position[0] + s * ahead + c * across + noise(), up + noise(), pose.position[2] + c * ahead - s * across + noise(),
  ];
}

export function pyramid(horizontal = 0.75, vertical = 0.5, rig = 0, x = 0) {
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([h, v]) => {
    const length = Math.hypot(horizontal, vertical, 1);
    return [(h * horizontal) / length, (v * vertical) / length, 1 / length];
  });
  return { shape: 0, rig, position: [x, 0, 0], corners };
}

export const sphere = { shape: 1, rig: 0, position: [0, 0, 0], corners: new Array(12).fill(0) };

/** A marker on the wall beside the way, its print towards it. */
function markerAt(id, time_s, side, is_surveyed) {
  const { position: [x, , z], yaw } = poseAt(time_s);
  const [s, c] = [Math.sin(yaw), Math.cos(yaw)];
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([along, down]) => {
    const ahead = 2 + (along * side) / 2;
    return [x + s * ahead + c * 2.1, -0.6 + (down * side) / 2, z + c * ahead - s * 2.1];
  });
  return { id, corners, is_surveyed, submap: 0 };
}

/** A session that grows frame by frame. */
export class Walk {
  constructor({ isSphere = false, isFree = false } = {}) {
    this.cameras = isSphere ? [sphere] : [pyramid(), pyramid(0.75, 0.5, 0, 0.11)];
    this.next = random(7);
    this.frames = [];
    this.keyframes = [];
    this.landmarks = new Map();
    this.covisibility = [];
    this.loops = [];
    this.submaps = [{ joined_into: NONE, is_metric: isFree ? 0 : 1 }];
    this.markers = [0, 7, 23, 586].map((id, i) => markerAt(id, 2 + 14 * i, 1.6, i % 2));
    this.nextLandmark = 0;
    this.isMapping = true;
  }

  /** Adds a frame; what is new or other than before. */
  step() {
    const frame = this.frames.length;
    const time_s = frame / RATE;
    const isStarting = frame < 12;
    const isLost = frame % 600 >= 320 && frame % 600 < 350;
    const pose = poseAt(time_s);
    const nan = (n) => new Array(n).fill(NaN);
    const tracking_ms = 11 + 3 * Math.sin(frame / 40) + 4 * this.next() ** 3 + (frame % 8 === 0 ? 5 : 0);
    const entry = {
      frame, time_s, tracking_ms, submap: 0, state: isStarting ? 0 : isLost ? 3 : 1, reason: isStarting ? 2 : isLost ? 3 : 0,
      position: isStarting || isLost ? nan(3) : pose.position, rotation: isStarting || isLost ? nan(4) : pose.rotation,
    };
    this.frames.push(entry);
    const changes = { frames: [entry], keyframes: [], landmarks: [], erased: [], covisibility: [], loops: false };
    if (entry.state === 1 && frame % 8 === 0 && this.isMapping) this.addKeyframe(entry, pose, changes);
    return changes;
  }

  addKeyframe(entry, pose, changes) {
    const id = this.keyframes.length;
    for (let i = 0; i < 110; ++i) {
      const grey = Math.floor(60 + 170 * this.next());
      const landmark = {
        id: this.nextLandmark, position: pointNear(pose, this.next), frame: entry.frame, observations: 2, submap: 0,
        colour: [grey, grey, grey, 255], seen: [id],
      };
      if (i % 10 === 0) landmark.half = [0, 0.12, 0];
      this.nextLandmark += 1 + Math.floor(3 * this.next());
      this.landmarks.set(landmark.id, landmark);
      changes.landmarks.push(landmark);
    }
    for (const landmark of [...this.landmarks.values()].slice(-400, -110)) {
      if (this.next() < 0.6) landmark.seen.push(id);
      landmark.observations = Math.max(2, landmark.seen.length);
      changes.landmarks.push(landmark);
    }
    for (const landmark of [...this.landmarks.values()].slice(-600, -400)) {
      if (this.next() > 0.06) continue;
      this.landmarks.delete(landmark.id);
      changes.erased.push(landmark.id);
    }
    const keyframe = { id, ...pose, frame: entry.frame, time_s: entry.time_s, parent: id > 0 ? id - 1 : NONE, landmarks: 300, rig: 0, submap: 0 };
    this.keyframes.push(keyframe);
    changes.keyframes.push(keyframe);
    const edges = [];
    for (let k = 1; k <= 5 && id - k >= 0; ++k) edges.push([id - k, 200 - 35 * k]);
    const before = id - Math.round((LAP_S * RATE) / 8);
    if (before > 0 && this.keyframes[before] && id % 3 === 0) {
      edges.push([before, 60]);
      if (id % 30 === 0) this.loops.push([id, before]);
      changes.loops = true;
    }
    const entryOfEdges = { id, edges };
    this.covisibility.push(entryOfEdges);
    changes.covisibility.push(entryOfEdges);
  }
}

/** 500 000 landmarks and 5 000 keyframes, in several laps that lie one above the other. */
export function largeMap(numLandmarks = 500000, numKeyframes = 5000) {
  const next = random(3);
  const walk = new Walk();
  const size = 60;
  const lift = (k) => 0.0016 * k;
  for (let id = 0; id < numKeyframes; ++id) {
    const pose = poseAt(id * 0.09, size);
    pose.position[1] -= lift(id);
    const common = { frame: 10 * id, time_s: id / 2 };
    walk.keyframes.push({ id, ...pose, ...common, parent: id > 0 ? id - 1 : NONE, landmarks: 400, rig: 0, submap: 0 });
    walk.frames.push({ ...common, ...pose, tracking_ms: 10 + 5 * next(), submap: 0, state: 1, reason: 0 });
    const edges = [];
    for (let k = 1; k <= 10 && id - k >= 0; ++k) edges.push([id - k, 200 - 15 * k]);
    walk.covisibility.push({ id, edges });
    if (id > 700 && id % 200 === 0) walk.loops.push([id, id - 667]);
  }
  for (let i = 0; i < numLandmarks; ++i) {
    const keyframe = walk.keyframes[Math.floor((i * numKeyframes) / numLandmarks)];
    const grey = Math.floor(60 + 170 * next());
    const landmark = {
      id: 3 * i, position: pointNear(keyframe, next), frame: keyframe.frame, observations: 2 + Math.floor(9 * next() ** 2), submap: 0,
      colour: [grey, grey, grey, 255], seen: [keyframe.id],
    };
    landmark.position[1] -= lift(keyframe.id);
    walk.landmarks.set(landmark.id, landmark);
  }
  return walk;
}
