// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { describe, expect, it } from "vitest";
import { Kind, NONE, type Landmarks, type Trajectory } from "../src/protocol";
import { Dirty } from "../src/store/dirty";
import { Store } from "../src/store/store";

function landmarks(ids: number[], x = 0): Landmarks {
  const n = ids.length;
  return {
    kind: Kind.Landmarks, id: Uint32Array.from(ids), position: new Float32Array(3 * n).fill(x),
    frame: new Uint32Array(n).fill(5), observations: new Uint16Array(n).fill(3), submap: new Uint16Array(n),
    colour: new Uint8Array(4 * n).fill(200),
  };
}

function frames(numbers: number[], x: number): Trajectory {
  const n = numbers.length;
  return {
    kind: Kind.Trajectory, frame: Uint32Array.from(numbers), position: new Float32Array(3 * n).fill(x),
    rotation: new Float32Array(4 * n).fill(x), time_s: Float32Array.from(numbers, (f) => f / 10),
    tracking_ms: new Float32Array(n), submap: new Uint16Array(n), state: new Uint8Array(n).fill(1), reason: new Uint8Array(n),
  };
}

describe("landmarks", () => {
  it("come, move and go; places are used again", () => {
    const store = new Store();
    store.apply(landmarks([3, 9, 5000]));
    store.apply({ kind: Kind.LandmarkPositions, id: Uint32Array.of(9, 10), position: Float32Array.of(1, 2, 3, 4, 5, 6) });
    store.apply({ kind: Kind.LandmarksErased, id: Uint32Array.of(3, 4) });
    expect(store.landmarks.count).toBe(2);
    const slot = store.landmarks.slots.find(9);
    expect([...store.landmarks.position.subarray(3 * slot, 3 * slot + 3)]).toEqual([1, 2, 3]);
    expect(store.landmarks.isAlive(0)).toBe(false);
    store.apply(landmarks([5001], 7));
    expect(store.landmarks.slots.find(5001)).toBe(0);
    expect(store.landmarks.isAlive(0)).toBe(true);
    expect(store.landmarks.slots.end).toBe(3);
  });
  it("with absurd ids are left out", () => {
    const store = new Store();
    store.apply(landmarks([1, 0xfffffff0]));
    expect(store.landmarks.count).toBe(1);
  });
  it("are as many after any edits as a plain set says", () => {
    const store = new Store();
    const truth = new Set<number>();
    let seed = 1;
    const random = (n: number) => (seed = (seed * 48271) % 2147483647) % n;
    for (let step = 0; step < 200; ++step) {
      const ids = Array.from({ length: 50 }, () => random(4000));
      if (random(2)) {
        store.apply(landmarks(ids));
        ids.forEach((id) => truth.add(id));
      } else {
        store.apply({ kind: Kind.LandmarksErased, id: Uint32Array.from(ids) });
        ids.forEach((id) => truth.delete(id));
      }
    }
    expect(store.landmarks.count).toBe(truth.size);
    const alive = [];
    for (let slot = 0; slot < store.landmarks.slots.end; ++slot) {
      if (store.landmarks.isAlive(slot)) alive.push(store.landmarks.id[slot]!);
    }
    expect(alive.sort((a, b) => a - b)).toEqual([...truth].sort((a, b) => a - b));
  });
});

describe("points on edges", () => {
  it("are landmarks until they go or become points again", () => {
    const store = new Store();
    store.apply(landmarks([3, 9]));
    const edges = (id: number[], half: number[]) => store.apply({ kind: Kind.EdgePoints, id: Uint32Array.from(id), half: Float32Array.from(half) });
    edges([3, 9, 77], [0, 1, 0, 0, 0, 2, 5, 5, 5]);
    expect(store.landmarks.numEdges).toBe(2);
    edges([9], [0, 0, 0]);
    expect([store.landmarks.isOnEdge(0), store.landmarks.isOnEdge(1), store.landmarks.numEdges]).toEqual([true, false, 1]);
    store.apply({ kind: Kind.LandmarksErased, id: Uint32Array.of(3) });
    store.apply(landmarks([4]));
    expect([store.landmarks.slots.find(4), store.landmarks.isOnEdge(0), store.landmarks.numEdges]).toEqual([0, false, 0]);
    store.apply(landmarks(Array.from({ length: 9000 }, (_, i) => 100 + i)));
    edges([9099], [1, 0, 0]);
    expect(store.landmarks.isOnEdge(store.landmarks.slots.find(9099))).toBe(true);
  });
});

describe("trajectory", () => {
  it("keeps frames in order, whenever their pose comes", () => {
    const { trajectory: table } = Object.assign(new Store());
    table.upsert(frames([0, 1, 5], 1));
    table.upsert(frames([6], NaN));
    expect([table.count, table.numPoses, table.lastPosed()]).toEqual([4, 3, 2]);
    table.upsert(frames([3, 6], 2));
    expect([...table.frame.subarray(0, table.count)]).toEqual([0, 1, 3, 5, 6]);
    expect([table.numPoses, table.position[6], table.position[9], table.lastPosed()]).toEqual([5, 2, 1, 4]);
    expect([0, 0.25, 0.3, 9].map((t) => table.indexAtTime(t + 1e-6))).toEqual([0, 1, 2, 4]);
  });
});

describe("the store", () => {
  it("forgets everything at begin", () => {
    const store = new Store();
    store.apply(landmarks([1, 2]));
    store.apply(frames([0], 1));
    store.apply({ kind: Kind.Begin, generation: 4, landmarks: 10, keyframes: 0, frames: 0 });
    expect([store.landmarks.count, store.trajectory.count, store.isLoading]).toEqual([0, 0, true]);
    store.apply({ kind: Kind.End, generation: 4 });
    expect([store.generation, store.isLoading]).toEqual([4, false]);
  });
  it("follows joined sub-maps to the end, even around a circle", () => {
    const store = new Store();
    store.apply({ kind: Kind.Submaps, joined_into: Uint32Array.of(NONE, 0, 1, 4, 3), is_metric: new Uint32Array(5) });
    expect([0, 1, 2, 9].map((s) => store.rootOf(s))).toEqual([0, 0, 0, 9]);
    expect(store.rootOf(3)).toBeGreaterThan(2);
  });
});

describe("changed places", () => {
  it("come as few ranges", () => {
    const dirty = new Dirty();
    [0, 2047, 2048, 300000].forEach((slot) => dirty.mark(slot));
    const told: number[][] = [];
    expect(dirty.take(300001, (first, last) => told.push([first, last]))).toBe(true);
    expect(told).toEqual([[0, 4096], [299008, 300001]]);
    expect(dirty.take(300001, () => expect.fail())).toBe(false);
  });
});
