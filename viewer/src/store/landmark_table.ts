// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { EdgePoints, Landmarks, LandmarkPositions, LandmarksErased } from "../protocol";
import { Dirty } from "./dirty";
import { grown, Slots } from "./slots";

/** Landmarks by place, ready to be uploaded as they are. Places that are free have no observations. */
export class LandmarkTable {
  readonly slots = new Slots();
  readonly movedSlots = new Dirty();
  readonly changedSlots = new Dirty();
  id = new Uint32Array(4096);
  position = new Float32Array(3 * 4096);
  /** Frame that it was made in; as float, since shaders take it so. */
  frame = new Float32Array(4096);
  /** Observations and sub-map of each. */
  facts = new Uint16Array(2 * 4096);
  colour = new Uint8Array(4 * 4096);
  /** Of points on edges: from the point to an end of what is drawn of its edge; 0 of others. Empty as long as there are none. */
  half = new Float32Array(0);
  numEdges = 0;

  get count(): number {
    return this.slots.count;
  }

  clear(): void {
    this.slots.clear();
    this.movedSlots.clear();
    this.changedSlots.clear();
    this.half.fill(0);
    this.numEdges = 0;
  }

  reserve(count: number): void {
    this.id = grown(this.id, count);
    this.position = grown(this.position, 3 * count);
    this.frame = grown(this.frame, count);
    this.facts = grown(this.facts, 2 * count);
    this.colour = grown(this.colour, 4 * count);
    if (this.half.length > 0) this.half = grown(this.half, 3 * count);
  }

  upsert(m: Landmarks): void {
    this.reserve(this.slots.end + m.id.length);
    const colours = new Uint32Array(this.colour.buffer);
    for (let i = 0; i < m.id.length; ++i) {
      const slot = this.slots.ensure(m.id[i]!);
      if (slot < 0) continue;
      this.id[slot] = m.id[i]!;
      this.move(slot, m.position, i);
      this.frame[slot] = m.frame[i]!;
      this.facts[2 * slot] = Math.max(1, m.observations[i]!);
      this.facts[2 * slot + 1] = m.submap[i]!;
      const c = 4 * i;
      colours[slot] = m.colour[c]! | (m.colour[c + 1]! << 8) | (m.colour[c + 2]! << 16) | (m.colour[c + 3]! << 24);
      this.changedSlots.mark(slot);
    }
  }

  moveAll(m: LandmarkPositions): void {
    for (let i = 0; i < m.id.length; ++i) {
      const slot = this.slots.find(m.id[i]!);
      if (slot >= 0) this.move(slot, m.position, i);
    }
  }

  erase(m: LandmarksErased): void {
    for (let i = 0; i < m.id.length; ++i) {
      const slot = this.slots.erase(m.id[i]!);
      if (slot < 0) continue;
      this.facts[2 * slot] = 0;
      this.changedSlots.mark(slot);
      if (this.isOnEdge(slot)) this.setHalf(slot, 0, 0, 0);
    }
  }

  setEdges(m: EdgePoints): void {
    if (m.id.length > 0) this.half = grown(this.half, this.position.length);
    for (let i = 0; i < m.id.length; ++i) {
      const slot = this.slots.find(m.id[i]!);
      if (slot >= 0) this.setHalf(slot, m.half[3 * i]!, m.half[3 * i + 1]!, m.half[3 * i + 2]!);
    }
  }

  isOnEdge(slot: number): boolean {
    return 3 * slot < this.half.length && (this.half[3 * slot] !== 0 || this.half[3 * slot + 1] !== 0 || this.half[3 * slot + 2] !== 0);
  }

  isAlive(slot: number): boolean {
    return this.facts[2 * slot]! > 0;
  }

  private setHalf(slot: number, x: number, y: number, z: number): void {
    this.numEdges -= Number(this.isOnEdge(slot));
    this.half[3 * slot] = x;
    this.half[3 * slot + 1] = y;
    this.half[3 * slot + 2] = z;
    this.numEdges += Number(this.isOnEdge(slot));
    this.changedSlots.mark(slot);
  }

  private move(slot: number, position: Float32Array, i: number): void {
    this.position[3 * slot] = position[3 * i]!;
    this.position[3 * slot + 1] = position[3 * i + 1]!;
    this.position[3 * slot + 2] = position[3 * i + 2]!;
    this.movedSlots.mark(slot);
  }
}
