// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { NONE, type Covisibility, type KeyframePoses, type Keyframes, type KeyframesErased } from "../protocol";
import { Dirty } from "./dirty";
import { grown, Slots } from "./slots";

/** Keyframes by place, and the edges between them by id. */
export class KeyframeTable {
  readonly slots = new Slots();
  readonly dirty = new Dirty();
  /** Goes up when edges come or go, or keyframes with edges do. */
  edgeVersion = 0;
  id = new Uint32Array(256);
  position = new Float32Array(3 * 256);
  rotation = new Float32Array(4 * 256);
  frame = new Uint32Array(256);
  time_s = new Float32Array(256);
  parent = new Uint32Array(256);
  landmarks = new Uint32Array(256);
  /** Rig (0xffff: the place is free) and sub-map of each. */
  facts = new Uint16Array(2 * 256);
  /** Older keyframes that share landmarks with the younger one. */
  readonly older = new Map<number, Uint32Array>();
  /** From and to, one pair after the other. */
  loops = new Uint32Array(0);

  get count(): number {
    return this.slots.count;
  }

  clear(): void {
    this.slots.clear();
    this.dirty.clear();
    this.older.clear();
    this.loops = new Uint32Array(0);
    ++this.edgeVersion;
  }

  reserve(count: number): void {
    this.id = grown(this.id, count);
    this.position = grown(this.position, 3 * count);
    this.rotation = grown(this.rotation, 4 * count);
    this.frame = grown(this.frame, count);
    this.time_s = grown(this.time_s, count);
    this.parent = grown(this.parent, count);
    this.landmarks = grown(this.landmarks, count);
    this.facts = grown(this.facts, 2 * count);
  }

  upsert(m: Keyframes): void {
    this.reserve(this.slots.end + m.id.length);
    for (let i = 0; i < m.id.length; ++i) {
      const isNew = this.slots.find(m.id[i]!) < 0;
      const slot = this.slots.ensure(m.id[i]!);
      if (slot < 0) continue;
      if (isNew || this.parent[slot] !== m.parent[i]) ++this.edgeVersion;
      this.id[slot] = m.id[i]!;
      this.frame[slot] = m.frame[i]!;
      this.time_s[slot] = m.time_s[i]!;
      this.parent[slot] = m.parent[i]!;
      this.landmarks[slot] = m.landmarks[i]!;
      this.facts[2 * slot] = m.rig[i]!;
      this.facts[2 * slot + 1] = m.submap[i]!;
      this.move(slot, m.position, m.rotation, i);
    }
  }

  moveAll(m: KeyframePoses): void {
    for (let i = 0; i < m.id.length; ++i) {
      const slot = this.slots.find(m.id[i]!);
      if (slot >= 0) this.move(slot, m.position, m.rotation, i);
    }
  }

  erase(m: KeyframesErased): void {
    for (let i = 0; i < m.id.length; ++i) {
      this.older.delete(m.id[i]!);
      const slot = this.slots.erase(m.id[i]!);
      if (slot < 0) continue;
      this.facts[2 * slot] = NONE & 0xffff;
      this.dirty.mark(slot);
    }
    ++this.edgeVersion;
  }

  setCovisibility(m: Covisibility): void {
    for (let i = 0; i < m.id.length; ++i) {
      this.older.set(m.id[i]!, m.other.slice(i > 0 ? m.end[i - 1] : 0, m.end[i]));
    }
    ++this.edgeVersion;
  }

  setLoops(from: Uint32Array, to: Uint32Array): void {
    this.loops = new Uint32Array(2 * from.length);
    for (let i = 0; i < from.length; ++i) {
      this.loops[2 * i] = from[i]!;
      this.loops[2 * i + 1] = to[i]!;
    }
    ++this.edgeVersion;
  }

  isAlive(slot: number): boolean {
    return this.facts[2 * slot] !== 0xffff;
  }

  private move(slot: number, position: Float32Array, rotation: Float32Array, i: number): void {
    for (let k = 0; k < 3; ++k) this.position[3 * slot + k] = position[3 * i + k]!;
    for (let k = 0; k < 4; ++k) this.rotation[4 * slot + k] = rotation[4 * i + k]!;
    this.dirty.mark(slot);
  }
}
