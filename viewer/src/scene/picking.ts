// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Matrix4, Vector3, type Camera, type Object3D } from "three";
import type { Store } from "../store/store";
import type { Parts } from "./parts";

export type Picked = { kind: "keyframe" | "landmark"; id: number };

const matrix = new Matrix4();
const offset = new Vector3();

interface Table {
  id: Uint32Array;
  position: Float32Array;
  facts: Uint16Array;
  slots: { end: number };
  isAlive(slot: number): boolean;
}

/** What is drawn closest to a point of the window, in device coordinates (-1 to 1); keyframes before landmarks. */
export function pick(
  store: Store, parts: Parts, camera: Camera, world: Object3D, at: { x: number; y: number }, perPixel: { x: number; y: number },
  what: { keyframes: boolean; landmarks: boolean },
): Picked | null {
  matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(world.matrixWorld);
  const keyframe = what.keyframes ? nearest(store.keyframes, parts, at, perPixel, 16) : -1;
  if (keyframe >= 0) return { kind: "keyframe", id: store.keyframes.id[keyframe]! };
  const landmark = what.landmarks ? nearest(store.landmarks, parts, at, perPixel, 10) : -1;
  return landmark >= 0 ? { kind: "landmark", id: store.landmarks.id[landmark]! } : null;
}

/** Place of the closest element that is at most `reach_px` away, or -1; of two about as close the one in front. */
function nearest(
  table: Table, parts: Parts, at: { x: number; y: number }, perPixel: { x: number; y: number }, reach_px: number,
): number {
  const e = matrix.elements;
  const { position, facts } = table;
  let best = -1;
  let bestCost = Infinity;
  for (let slot = 0; slot < table.slots.end; ++slot) {
    if (!table.isAlive(slot)) continue;
    parts.offset(facts[2 * slot + 1]!, offset);
    const x = position[3 * slot]! + offset.x;
    const y = position[3 * slot + 1]! + offset.y;
    const z = position[3 * slot + 2]! + offset.z;
    const w = e[3]! * x + e[7]! * y + e[11]! * z + e[15]!;
    if (w <= 0) continue;
    const dx = ((e[0]! * x + e[4]! * y + e[8]! * z + e[12]!) / w - at.x) / perPixel.x;
    const dy = ((e[1]! * x + e[5]! * y + e[9]! * z + e[13]!) / w - at.y) / perPixel.y;
    const distance_px = Math.hypot(dx, dy);
    if (distance_px > reach_px) continue;
    const cost = (distance_px + 2) * w;
    if (cost < bestCost) {
      bestCost = cost;
      best = slot;
    }
  }
  return best;
}
