// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Vector3 } from "three";
import { expect, it } from "vitest";
import { Kind, NONE } from "../src/protocol";
import { Parts } from "../src/scene/parts";
import { Store } from "../src/store/store";

/** Keyframes of sub-maps 0, 1 and 2, each 4 long from x = 0 on. */
function threeParts(joined_into: number[]): Store {
  const store = new Store();
  store.apply({ kind: Kind.Submaps, joined_into: Uint32Array.from(joined_into), is_metric: new Uint32Array(3) });
  const position = new Float32Array(18);
  [0, 4, 0, 4, 0, 4].forEach((x, i) => (position[3 * i] = x));
  store.apply({
    kind: Kind.Keyframes, id: Uint32Array.of(0, 1, 2, 3, 4, 5), position, rotation: new Float32Array(24), frame: new Uint32Array(6),
    time_s: new Float32Array(6), parent: new Uint32Array(6).fill(NONE), landmarks: new Uint32Array(6), rig: new Uint16Array(6),
    submap: Uint16Array.of(0, 0, 1, 1, 2, 2),
  });
  return store;
}

it("parts that are not joined lie side by side, joined ones together", () => {
  const parts = new Parts();
  const x = (part: number) => parts.offset(part, new Vector3()).x;
  expect(parts.arrange(threeParts([NONE, NONE, NONE]))).toBe(true);
  expect(x(0)).toBe(0);
  expect(x(1)).toBeGreaterThan(4);
  expect(x(2)).toBeGreaterThan(x(1) + 4);
  expect(parts.arrange(threeParts([NONE, NONE, NONE]))).toBe(false);
  expect(parts.arrange(threeParts([NONE, NONE, 1]))).toBe(true);
  expect(x(2)).toBe(x(1));
  expect(parts.arrange(threeParts([NONE, 0, 1]))).toBe(true);
  expect([x(0), x(1), x(2)]).toEqual([0, 0, 0]);
});
