// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

/** Binary messages of docs/viewer-protocol.md: typed arrays laid over what came in, nothing is copied. */

export const PROTOCOL_VERSION = 1;
export const NONE = 0xffffffff;
export const NO_SUBMAP = 0xffff;

export const Kind = {
  Begin: 1,
  End: 2,
  Landmarks: 3,
  LandmarkPositions: 4,
  LandmarksErased: 5,
  Cameras: 6,
  Keyframes: 7,
  KeyframePoses: 8,
  KeyframesErased: 9,
  Covisibility: 10,
  Loops: 11,
  Trajectory: 12,
  Frame: 13,
  Submaps: 14,
  Markers: 15,
  EdgePoints: 16,
  KeyframeImage: 17,
} as const;

export interface Begin {
  kind: typeof Kind.Begin;
  generation: number;
  landmarks: number;
  keyframes: number;
  frames: number;
}
export interface End {
  kind: typeof Kind.End;
  generation: number;
}
export interface Landmarks {
  kind: typeof Kind.Landmarks;
  id: Uint32Array;
  position: Float32Array;
  frame: Uint32Array;
  observations: Uint16Array;
  submap: Uint16Array;
  colour: Uint8Array;
}
export interface LandmarkPositions {
  kind: typeof Kind.LandmarkPositions;
  id: Uint32Array;
  position: Float32Array;
}
export interface LandmarksErased {
  kind: typeof Kind.LandmarksErased;
  id: Uint32Array;
}
export interface Cameras {
  kind: typeof Kind.Cameras;
  shape: Uint32Array;
  rig: Uint32Array;
  position: Float32Array;
  corners: Float32Array;
}
export interface Keyframes {
  kind: typeof Kind.Keyframes;
  id: Uint32Array;
  position: Float32Array;
  rotation: Float32Array;
  frame: Uint32Array;
  time_s: Float32Array;
  parent: Uint32Array;
  landmarks: Uint32Array;
  rig: Uint16Array;
  submap: Uint16Array;
}
export interface KeyframePoses {
  kind: typeof Kind.KeyframePoses;
  id: Uint32Array;
  position: Float32Array;
  rotation: Float32Array;
}
export interface KeyframesErased {
  kind: typeof Kind.KeyframesErased;
  id: Uint32Array;
}
export interface Covisibility {
  kind: typeof Kind.Covisibility;
  id: Uint32Array;
  end: Uint32Array;
  other: Uint32Array;
  shared: Uint16Array;
}
export interface Loops {
  kind: typeof Kind.Loops;
  from: Uint32Array;
  to: Uint32Array;
}
export interface Trajectory {
  kind: typeof Kind.Trajectory;
  frame: Uint32Array;
  position: Float32Array;
  rotation: Float32Array;
  time_s: Float32Array;
  tracking_ms: Float32Array;
  submap: Uint16Array;
  state: Uint8Array;
  reason: Uint8Array;
}
export interface Frame {
  kind: typeof Kind.Frame;
  frame: number;
  time_s: number;
  width_px: number;
  height_px: number;
  pixel: Float32Array;
  state: Uint8Array;
  jpeg: Uint8Array;
}
export interface Submaps {
  kind: typeof Kind.Submaps;
  joined_into: Uint32Array;
  is_metric: Uint32Array;
}

export interface Markers {
  kind: typeof Kind.Markers;
  id: Uint32Array;
  corners: Float32Array;
  is_surveyed: Uint32Array;
  submap: Uint16Array;
}
export interface EdgePoints {
  kind: typeof Kind.EdgePoints;
  id: Uint32Array;
  half: Float32Array;
}
export interface KeyframeImage {
  kind: typeof Kind.KeyframeImage;
  request: number;
  keyframe: number;
  width_px: number;
  height_px: number;
  pixel: Float32Array;
  state: Uint8Array;
  jpeg: Uint8Array;
}

export type Message =
  | Begin | End | Landmarks | LandmarkPositions | LandmarksErased | Cameras | Keyframes
  | KeyframePoses | KeyframesErased | Covisibility | Loops | Trajectory | Frame | Submaps
  | Markers | EdgePoints | KeyframeImage;

/** Takes one array after the other off a message; throws RangeError where the message is too short. */
class Reader {
  private offset = 8;
  constructor(private readonly buffer: ArrayBuffer) {}

  u32(count: number): Uint32Array<ArrayBuffer> {
    return new Uint32Array(this.buffer, this.advance(4 * count), count);
  }
  f32(count: number): Float32Array<ArrayBuffer> {
    return new Float32Array(this.buffer, this.advance(4 * count), count);
  }
  u16(count: number): Uint16Array<ArrayBuffer> {
    return new Uint16Array(this.buffer, this.advance(2 * count), count);
  }
  u8(count: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.buffer, this.advance(count), count);
  }
  pad(): void {
    this.offset = (this.offset + 3) & ~3;
  }
  done(): void {
    if (this.offset !== this.buffer.byteLength) {
      throw new RangeError(`${this.buffer.byteLength - this.offset} bytes too many`);
    }
  }
  private advance(bytes: number): number {
    const at = this.offset;
    this.offset += bytes;
    return at;
  }
}

type Decoder = (reader: Reader, n: number) => Message;

const decoders: Record<number, Decoder> = {
  [Kind.Begin](r) {
    const [generation, landmarks, keyframes, frames] = r.u32(4);
    return { kind: Kind.Begin, generation: generation!, landmarks: landmarks!, keyframes: keyframes!, frames: frames! };
  },
  [Kind.End]: (r) => ({ kind: Kind.End, generation: r.u32(1)[0]! }),
  [Kind.Landmarks]: (r, n) => ({
    kind: Kind.Landmarks, id: r.u32(n), position: r.f32(3 * n), frame: r.u32(n),
    observations: r.u16(n), submap: r.u16(n), colour: r.u8(4 * n),
  }),
  [Kind.LandmarkPositions]: (r, n) => ({ kind: Kind.LandmarkPositions, id: r.u32(n), position: r.f32(3 * n) }),
  [Kind.LandmarksErased]: (r, n) => ({ kind: Kind.LandmarksErased, id: r.u32(n) }),
  [Kind.Cameras]: (r, n) => ({
    kind: Kind.Cameras, shape: r.u32(n), rig: r.u32(n), position: r.f32(3 * n), corners: r.f32(12 * n),
  }),
  [Kind.Keyframes]: (r, n) => ({
    kind: Kind.Keyframes, id: r.u32(n), position: r.f32(3 * n), rotation: r.f32(4 * n), frame: r.u32(n),
    time_s: r.f32(n), parent: r.u32(n), landmarks: r.u32(n), rig: r.u16(n), submap: r.u16(n),
  }),
  [Kind.KeyframePoses]: (r, n) => ({
    kind: Kind.KeyframePoses, id: r.u32(n), position: r.f32(3 * n), rotation: r.f32(4 * n),
  }),
  [Kind.KeyframesErased]: (r, n) => ({ kind: Kind.KeyframesErased, id: r.u32(n) }),
  [Kind.Covisibility](r, n) {
    const id = r.u32(n);
    const end = r.u32(n);
    const m = n > 0 ? end[n - 1]! : 0;
    const message: Covisibility = { kind: Kind.Covisibility, id, end, other: r.u32(m), shared: r.u16(m) };
    r.pad();
    return message;
  },
  [Kind.Loops]: (r, n) => ({ kind: Kind.Loops, from: r.u32(n), to: r.u32(n) }),
  [Kind.Trajectory]: (r, n) => ({
    kind: Kind.Trajectory, frame: r.u32(n), position: r.f32(3 * n), rotation: r.f32(4 * n), time_s: r.f32(n),
    tracking_ms: r.f32(n), submap: r.u16(n), state: r.u8(n), reason: r.u8(n),
  }),
  [Kind.Frame](r, n) {
    const frame = r.u32(1)[0]!;
    const time_s = r.f32(1)[0]!;
    const [width_px, height_px, bytes] = r.u32(3);
    const pixel = r.f32(2 * n);
    const state = r.u8(n);
    r.pad();
    return {
      kind: Kind.Frame, frame, time_s, width_px: width_px!, height_px: height_px!, pixel, state, jpeg: r.u8(bytes!),
    };
  },
  [Kind.Submaps]: (r, n) => ({ kind: Kind.Submaps, joined_into: r.u32(n), is_metric: r.u32(n) }),
  [Kind.Markers](r, n) {
    const message: Markers = { kind: Kind.Markers, id: r.u32(n), corners: r.f32(12 * n), is_surveyed: r.u32(n), submap: r.u16(n) };
    r.pad();
    return message;
  },
  [Kind.EdgePoints]: (r, n) => ({ kind: Kind.EdgePoints, id: r.u32(n), half: r.f32(3 * n) }),
  [Kind.KeyframeImage](r, n) {
    const [low, high, keyframe, width_px, height_px, bytes] = r.u32(6);
    const pixel = r.f32(2 * n);
    const state = r.u8(n);
    r.pad();
    return {
      kind: Kind.KeyframeImage, request: low! + high! * 2 ** 32, keyframe: keyframe!, width_px: width_px!, height_px: height_px!, pixel,
      state, jpeg: r.u8(bytes!),
    };
  },
};

/**
 * The message in `buffer`, or null where its kind is unknown. Throws RangeError where version or length are wrong.
 * The arrays are views: they are valid as long as `buffer` is.
 */
export function decode(buffer: ArrayBuffer): Message | null {
  if (buffer.byteLength < 8) throw new RangeError(`${buffer.byteLength} bytes, a header has 8`);
  const view = new DataView(buffer);
  const version = view.getUint8(1);
  if (version !== PROTOCOL_VERSION) throw new RangeError(`protocol version ${version}, expected ${PROTOCOL_VERSION}`);
  const decoder = decoders[view.getUint8(0)];
  if (!decoder) return null;
  const reader = new Reader(buffer);
  const message = decoder(reader, view.getUint32(4, true));
  reader.done();
  return message;
}
