// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Vector3, type Object3D } from "three";
import type { Store } from "../store/store";
import type { Parts } from "./parts";

/** How large the map is and where, as it is drawn. */
export class Extent {
  readonly centre = new Vector3();
  radius = 2;
  /** Typical distance of neighbouring keyframes: what cameras and points are drawn by. */
  step = 0.2;
  /** Of the ground, as drawn. */
  floor = -1;
  private readonly low = new Vector3();
  private readonly high = new Vector3();
  private readonly point = new Vector3();
  private readonly offset = new Vector3();

  /** Measures keyframes (all) and the spread of heights that `heights` says; false where there is nothing to measure. */
  measure(store: Store, parts: Parts, world: Object3D, lowestHeight: number): boolean {
    const { keyframes } = store;
    if (keyframes.count === 0) return false;
    let path = 0;
    let links = 0;
    for (let slot = 0; slot < keyframes.slots.end; ++slot) {
      if (!keyframes.isAlive(slot)) continue;
      const parent = keyframes.slots.find(keyframes.parent[slot]!);
      if (parent < 0) continue;
      path += Math.hypot(
        keyframes.position[3 * slot]! - keyframes.position[3 * parent]!,
        keyframes.position[3 * slot + 1]! - keyframes.position[3 * parent + 1]!,
        keyframes.position[3 * slot + 2]! - keyframes.position[3 * parent + 2]!,
      );
      ++links;
    }
    if (links > 0 && path > 0) this.step = path / links;
    this.radius = this.sphere(store, parts, world, this.centre);
    this.floor = Math.max(lowestHeight, this.centre.y - 2 * this.radius);
    return true;
  }

  /** The sphere that holds the keyframes of a part of the map, or of all: the radius, and the centre in `centre`. */
  sphere(store: Store, parts: Parts, world: Object3D, centre: Vector3, part: number | null = null): number {
    const { keyframes } = store;
    this.low.setScalar(Infinity);
    this.high.setScalar(-Infinity);
    for (let slot = 0; slot < keyframes.slots.end; ++slot) {
      if (!keyframes.isAlive(slot)) continue;
      const submap = keyframes.facts[2 * slot + 1]!;
      if (part !== null && store.rootOf(submap) !== part) continue;
      this.point.fromArray(keyframes.position, 3 * slot).add(parts.offset(submap, this.offset));
      this.low.min(this.point);
      this.high.max(this.point);
    }
    centre.addVectors(this.low, this.high).multiplyScalar(0.5).applyMatrix4(world.matrixWorld);
    return Math.max(0.62 * this.low.distanceTo(this.high), 6 * this.step);
  }
}
