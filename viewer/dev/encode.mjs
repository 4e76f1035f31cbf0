// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

// Writes the binary messages of docs/viewer-protocol.md.

const widths = { f32: 4, u32: 4, u16: 2, u8: 1 };
const writers = { f32: "writeFloatLE", u32: "writeUInt32LE", u16: "writeUInt16LE", u8: "writeUInt8" };

/** A message of `n` elements from pairs of type and values, padded to a multiple of `multiple` bytes. */
export function message(kind, n, fields, multiple = 1) {
  const size = fields.reduce((sum, [type, values]) => sum + widths[type] * values.length, 8);
  const bytes = Buffer.alloc(Math.ceil(size / multiple) * multiple);
  bytes[0] = kind;
  bytes[1] = 1;
  bytes.writeUInt32LE(n, 4);
  let at = 8;
  for (const [type, values] of fields) {
    for (const value of values) at = bytes[writers[type]](value, at);
  }
  return bytes;
}

const flat = (items, field) => items.flatMap((item) => item[field]);
const each = (items, field) => items.map((item) => item[field]);

export const begin = (generation, counts) => message(1, 0, [["u32", [generation, ...counts]]]);
export const end = (generation) => message(2, 0, [["u32", [generation]]]);

export const landmarks = (items) => message(3, items.length, [
  ["u32", each(items, "id")], ["f32", flat(items, "position")], ["u32", each(items, "frame")],
  ["u16", each(items, "observations")], ["u16", each(items, "submap")], ["u8", flat(items, "colour")],
]);
export const landmarkPositions = (items) => message(4, items.length, [["u32", each(items, "id")], ["f32", flat(items, "position")]]);
export const landmarksErased = (ids) => message(5, ids.length, [["u32", ids]]);
export const cameras = (items) => message(6, items.length, [
  ["u32", each(items, "shape")], ["u32", each(items, "rig")], ["f32", flat(items, "position")], ["f32", flat(items, "corners")],
]);
export const keyframes = (items) => message(7, items.length, [
  ["u32", each(items, "id")], ["f32", flat(items, "position")], ["f32", flat(items, "rotation")], ["u32", each(items, "frame")],
  ["f32", each(items, "time_s")], ["u32", each(items, "parent")], ["u32", each(items, "landmarks")],
  ["u16", each(items, "rig")], ["u16", each(items, "submap")],
]);
export const keyframePoses = (items) => message(8, items.length, [
  ["u32", each(items, "id")], ["f32", flat(items, "position")], ["f32", flat(items, "rotation")],
]);
export function covisibility(items) {
  let total = 0;
  const ends = items.map(({ edges }) => (total += edges.length));
  const edges = flat(items, "edges");
  return message(10, items.length, [
    ["u32", each(items, "id")], ["u32", ends], ["u32", edges.map(([other]) => other)], ["u16", edges.map(([, shared]) => shared)],
  ], 4);
}
export const loops = (pairs) => message(11, pairs.length, [["u32", pairs.map(([a]) => a)], ["u32", pairs.map(([, b]) => b)]]);
export const trajectory = (items) => message(12, items.length, [
  ["u32", each(items, "frame")], ["f32", flat(items, "position")], ["f32", flat(items, "rotation")], ["f32", each(items, "time_s")],
  ["f32", each(items, "tracking_ms")], ["u16", each(items, "submap")], ["u8", each(items, "state")], ["u8", each(items, "reason")],
]);
export function frame({ frame, time_s, width_px, height_px, pixels, states }) {
  const padding = new Array((4 - (states.length % 4)) % 4).fill(0);
  return message(13, states.length, [
    ["u32", [frame]], ["f32", [time_s]], ["u32", [width_px, height_px, 0]], ["f32", pixels.flat()], ["u8", [...states, ...padding]],
  ]);
}
export const submaps = (items) => message(14, items.length, [["u32", each(items, "joined_into")], ["u32", each(items, "is_metric")]]);
export const markers = (items) => message(15, items.length, [
  ["u32", each(items, "id")], ["f32", flat(items, "corners")], ["u32", each(items, "is_surveyed")], ["u16", each(items, "submap")],
], 4);
export const edgePoints = (items) => message(16, items.length, [["u32", each(items, "id")], ["f32", flat(items, "half")]]);
export function keyframeImage({ request, keyframe, width_px, height_px, pixels, states, jpeg }) {
  const padding = new Array((4 - (states.length % 4)) % 4).fill(0);
  const head = message(17, states.length, [
    ["u32", [request, 0, keyframe, width_px, height_px, jpeg.length]], ["f32", pixels.flat()], ["u8", [...states, ...padding]],
  ]);
  return Buffer.concat([head, jpeg]);
}
