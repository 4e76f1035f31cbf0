// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Trajectory } from "../protocol";
import { Dirty } from "./dirty";
import { grown } from "./slots";

/** Every frame of the session, in the order of their numbers, with a pose or without. */
export class TrajectoryTable {
  readonly dirty = new Dirty();
  count = 0;
  /** Frames that have a pose. */
  numPoses = 0;
  /** Goes up with every change. */
  version = 0;
  frame = new Uint32Array(1024);
  /** 0 where there is no pose, so that nothing of it reaches the graphics card. */
  position = new Float32Array(3 * 1024);
  rotation = new Float32Array(4 * 1024);
  time_s = new Float32Array(1024);
  tracking_ms = new Float32Array(1024);
  /** 1 + state where there is a pose, else 0, and sub-map of each. */
  facts = new Uint16Array(2 * 1024);
  state = new Uint8Array(1024);
  reason = new Uint8Array(1024);

  clear(): void {
    this.dirty.clear();
    this.count = 0;
    this.numPoses = 0;
    ++this.version;
  }

  reserve(count: number): void {
    this.frame = grown(this.frame, count);
    this.position = grown(this.position, 3 * count);
    this.rotation = grown(this.rotation, 4 * count);
    this.time_s = grown(this.time_s, count);
    this.tracking_ms = grown(this.tracking_ms, count);
    this.facts = grown(this.facts, 2 * count);
    this.state = grown(this.state, count);
    this.reason = grown(this.reason, count);
  }

  upsert(m: Trajectory): void {
    this.reserve(this.count + m.frame.length);
    for (let i = 0; i < m.frame.length; ++i) this.put(this.placeOf(m.frame[i]!), m, i);
    ++this.version;
  }

  hasPose(index: number): boolean {
    return this.facts[2 * index]! > 0;
  }

  submap(index: number): number {
    return this.facts[2 * index + 1]!;
  }

  /** The last frame up to `index` that has a pose, or -1. */
  lastPosed(index = this.count - 1): number {
    while (index >= 0 && !this.hasPose(index)) --index;
    return index;
  }

  /** Index of the last frame that is not after `time_s`, or 0. */
  indexAtTime(time_s: number): number {
    return Math.max(0, this.upperBound(this.time_s, time_s) - 1);
  }

  private put(index: number, m: Trajectory, i: number): void {
    const hasPose = !Number.isNaN(m.position[3 * i]);
    this.numPoses += Number(hasPose) - Number(this.hasPose(index));
    for (let k = 0; k < 3; ++k) this.position[3 * index + k] = hasPose ? m.position[3 * i + k]! : 0;
    for (let k = 0; k < 4; ++k) this.rotation[4 * index + k] = hasPose ? m.rotation[4 * i + k]! : 0;
    this.time_s[index] = m.time_s[i]!;
    this.tracking_ms[index] = m.tracking_ms[i]!;
    this.facts[2 * index] = hasPose ? 1 + m.state[i]! : 0;
    this.facts[2 * index + 1] = m.submap[i]!;
    this.state[index] = m.state[i]!;
    this.reason[index] = m.reason[i]!;
    this.dirty.mark(index);
  }

  /** Index of `frame`, which is made where it is not there: mostly at the end. */
  private placeOf(frame: number): number {
    let index = this.count;
    if (index > 0 && frame <= this.frame[index - 1]!) {
      index = this.upperBound(this.frame, frame);
      if (index > 0 && this.frame[index - 1] === frame) return index - 1;
      this.shift(index);
    }
    this.frame[index] = frame;
    this.facts[2 * index] = 0;
    ++this.count;
    return index;
  }

  /** Makes room at `index`. */
  private shift(index: number): void {
    const widths: [Float32Array | Uint32Array | Uint16Array | Uint8Array, number][] = [
      [this.frame, 1], [this.position, 3], [this.rotation, 4], [this.time_s, 1],
      [this.tracking_ms, 1], [this.facts, 2], [this.state, 1], [this.reason, 1],
    ];
    for (const [array, width] of widths) array.copyWithin(width * (index + 1), width * index, width * this.count);
    for (let i = index; i <= this.count; ++i) this.dirty.mark(i);
  }

  /** Number of entries that are not above `value`. */
  private upperBound(ascending: Float32Array | Uint32Array, value: number): number {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (ascending[middle]! <= value) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
