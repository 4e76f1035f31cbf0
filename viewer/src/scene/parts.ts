// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { DataTexture, FloatType, RGBAFormat, Vector3 } from "three";
import { NO_SUBMAP } from "../protocol";
import type { Store } from "../store/store";

const WIDTH = 64;
const MAX_PARTS = WIDTH * WIDTH;

/**
 * Where each sub-map is drawn. Sub-maps that are not joined have nothing to do with each other: they are put side by side, along x, so
 * that they do not lie on top of each other. The texture has one offset each.
 */
export class Parts {
  readonly texture: DataTexture;
  private readonly offsets = new Float32Array(4 * MAX_PARTS);
  private low = new Float32Array(0);
  private high = new Float32Array(0);

  constructor() {
    this.texture = new DataTexture(this.offsets, WIDTH, WIDTH, RGBAFormat, FloatType);
    this.texture.needsUpdate = true;
  }

  offset(submap: number, out: Vector3): Vector3 {
    const at = 4 * Math.min(submap, MAX_PARTS - 1);
    return out.set(this.offsets[at]!, this.offsets[at + 1]!, this.offsets[at + 2]!);
  }

  /** Puts the parts beside each other; true where a place changed. */
  arrange(store: Store): boolean {
    const count = Math.min(MAX_PARTS, store.submaps?.joined_into.length ?? 1);
    this.measure(store, count);
    let changed = false;
    let edge = NaN;
    for (let part = 0; part < count; ++part) {
      if (store.rootOf(part) !== part) continue;
      if (!(this.low[part]! <= this.high[part]!)) continue;
      const width = this.high[part]! - this.low[part]!;
      const margin = 0.25 * width + 0.5;
      const x = Number.isNaN(edge) ? 0 : edge + margin - this.low[part]!;
      edge = Math.max(edge || -Infinity, x + this.high[part]! + margin);
      changed = this.place(part, x) || changed;
    }
    for (let part = 0; part < count; ++part) {
      const root = store.rootOf(part);
      if (root !== part) changed = this.place(part, this.offsets[4 * root]!) || changed;
    }
    if (changed) this.texture.needsUpdate = true;
    return changed;
  }

  clear(): void {
    this.offsets.fill(0);
    this.texture.needsUpdate = true;
  }

  private place(part: number, x: number): boolean {
    // Small changes are left alone, so that a growing part does not push the others about all the time.
    if (Math.abs(x - this.offsets[4 * part]!) <= 0.02 * Math.abs(x)) return false;
    this.offsets[4 * part] = x;
    return true;
  }

  private measure(store: Store, count: number): void {
    if (this.low.length < count) {
      this.low = new Float32Array(count);
      this.high = new Float32Array(count);
    }
    this.low.fill(Infinity);
    this.high.fill(-Infinity);
    const { keyframes } = store;
    for (let slot = 0; slot < keyframes.slots.end; ++slot) {
      if (!keyframes.isAlive(slot)) continue;
      const submap = keyframes.facts[2 * slot + 1]!;
      if (submap === NO_SUBMAP || submap >= count) continue;
      const root = store.rootOf(submap);
      const x = keyframes.position[3 * slot]!;
      if (x < this.low[root]!) this.low[root] = x;
      if (x > this.high[root]!) this.high[root] = x;
    }
  }
}
