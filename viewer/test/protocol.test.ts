// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { decode, Kind, type Message } from "../src/protocol";

/** The worked examples of docs/viewer-protocol.md by the number of their kind: those lines in backquotes that are all hexadecimal. */
function examples(): Map<number, ArrayBuffer> {
  const text = readFileSync(new URL("../../docs/viewer-protocol.md", import.meta.url), "utf8");
  const found = new Map<number, ArrayBuffer>();
  for (const [, hex] of text.matchAll(/`([0-9a-f]{2} 01 [0-9a-f ]+)`/g)) {
    const bytes = Uint8Array.from(hex!.replaceAll(" ", "").match(/../g)!, (byte) => parseInt(byte, 16));
    found.set(bytes[0]!, bytes.buffer);
  }
  return found;
}

const documented = examples();

function decoded<K extends number>(kind: K): Extract<Message, { kind: K }> {
  const message = decode(documented.get(kind)!);
  expect(message?.kind).toBe(kind);
  return message as Extract<Message, { kind: K }>;
}

describe("the worked examples of the document", () => {
  it("has one for every kind", () => {
    expect([...documented.keys()].sort((a, b) => a - b)).toEqual(Object.values(Kind));
  });
  it("begin and end", () => {
    expect(decoded(Kind.Begin)).toEqual({ kind: 1, generation: 3, landmarks: 10000, keyframes: 100, frames: 1000 });
    expect(decoded(Kind.End).generation).toBe(3);
  });
  it("landmarks", () => {
    const m = decoded(Kind.Landmarks);
    expect([...m.id, ...m.position, ...m.frame]).toEqual([7, 1, 2, 3, 5]);
    expect([...m.observations, ...m.submap, ...m.colour]).toEqual([4, 0, 128, 128, 128, 255]);
  });
  it("positions and erased ones", () => {
    const moved = decoded(Kind.LandmarkPositions);
    expect([...moved.id, ...moved.position]).toEqual([7, 1, 2, 4]);
    expect([...decoded(Kind.LandmarksErased).id]).toEqual([7, 9]);
    expect([...decoded(Kind.KeyframesErased).id]).toEqual([2]);
  });
  it("cameras", () => {
    const m = decoded(Kind.Cameras);
    expect([...m.shape, ...m.rig, ...m.position]).toEqual([0, 0, 0, 0, 0]);
    const a = 1 / Math.sqrt(3);
    const expected = [-a, -a, a, a, -a, a, a, a, a, -a, a, a];
    m.corners.forEach((value, i) => expect(value).toBeCloseTo(expected[i]!, 6));
  });
  it("keyframes and their poses", () => {
    const m = decoded(Kind.Keyframes);
    expect([...m.id, ...m.position, ...m.rotation]).toEqual([2, 1, 0, 0, 0, 0, 0, 1]);
    expect([...m.frame, ...m.time_s, ...m.parent, ...m.landmarks]).toEqual([10, 0.5, 1, 100]);
    expect([...m.rig, ...m.submap]).toEqual([0, 0]);
    const moved = decoded(Kind.KeyframePoses);
    expect([...moved.id, ...moved.position, ...moved.rotation]).toEqual([2, 1, 0, 1, 0, 0, 0, 1]);
  });
  it("edges", () => {
    const m = decoded(Kind.Covisibility);
    expect([[...m.id], [...m.end], [...m.other], [...m.shared]]).toEqual([[2, 3], [1, 3], [1, 1, 2], [50, 30, 70]]);
    const loops = decoded(Kind.Loops);
    expect([...loops.from, ...loops.to]).toEqual([100, 3]);
    const submaps = decoded(Kind.Submaps);
    expect([[...submaps.joined_into], [...submaps.is_metric]]).toEqual([[0xffffffff, 0], [1, 1]]);
  });
  it("trajectory", () => {
    const m = decoded(Kind.Trajectory);
    expect([...m.frame, ...m.position, ...m.rotation]).toEqual([10, 1, 0, 0, 0, 0, 0, 1]);
    expect([...m.time_s, ...m.tracking_ms, ...m.submap, ...m.state, ...m.reason]).toEqual([0.5, 12.5, 0, 1, 0]);
  });
  it("frame", () => {
    const m = decoded(Kind.Frame);
    expect([m.frame, m.time_s, m.width_px, m.height_px, m.jpeg.length]).toEqual([10, 0.5, 640, 480, 0]);
    expect([...m.pixel, ...m.state]).toEqual([100, 50, 1]);
  });
});

describe("the later kinds", () => {
  it("markers", () => {
    const m = decoded(Kind.Markers);
    expect([[...m.id], [...m.corners], [...m.is_surveyed], [...m.submap]]).toEqual([[7], [0, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1, 2], [1], [0]]);
  });
  it("points on edges", () => {
    const m = decoded(Kind.EdgePoints);
    expect([[...m.id], [...m.half]]).toEqual([[7], [0, 0.5, 0]]);
  });
  it("the image of a keyframe", () => {
    const m = decoded(Kind.KeyframeImage);
    expect([m.request, m.keyframe, m.width_px, m.height_px, ...m.pixel, ...m.state]).toEqual([6, 2, 640, 480, 100, 50, 1]);
    expect([...m.jpeg]).toEqual([0xff, 0xd8, 0xff, 0xd9]);
  });
});

describe("anything else", () => {
  it("ignores kinds it does not know", () => {
    expect(decode(Uint8Array.from([99, 1, 0, 0, 0, 0, 0, 0]).buffer)).toBeNull();
  });
  it("refuses other versions, and lengths that do not fit", () => {
    expect(() => decode(new ArrayBuffer(3))).toThrow(RangeError);
    for (const bytes of documented.values()) {
      expect(() => decode(bytes.slice(0, bytes.byteLength - 1))).toThrow(RangeError);
      const longer = new Uint8Array(bytes.byteLength + 4);
      longer.set(new Uint8Array(bytes));
      expect(() => decode(longer.buffer)).toThrow(RangeError);
      longer[1] = 2;
      expect(() => decode(longer.buffer)).toThrow(/version 2/);
    }
    const many = new Uint8Array(documented.get(Kind.Landmarks)!.slice(0));
    many.fill(0xff, 4, 8);
    expect(() => decode(many.buffer)).toThrow(RangeError);
  });
});
