// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { BufferAttribute, DataTexture, FloatType, InstancedBufferGeometry, RGBAFormat } from "three";
import type { Cameras } from "../protocol";

const MAX_CAMERAS = 8;
const TEXELS_PER_CAMERA = 5;
const RING_SEGMENTS = 20;
/** Lines of a pyramid between its points: 0 the apex, 1 to 4 the corners. */
const PYRAMID = [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1];

/** Outlines of the cameras of all rigs, as a texture: for each camera its position and shape, then its four corners. */
export class CameraShapes {
  readonly uniform: { value: DataTexture };
  readonly numRigs = { value: 0 };
  /** How many cameras are pyramids, and how many spheres. */
  readonly count = [0, 0];
  private camerasPerRig = 1;

  constructor() {
    this.uniform = { value: textureOf(new Float32Array(4 * MAX_CAMERAS * TEXELS_PER_CAMERA), 1) };
  }

  update(cameras: Cameras | null): void {
    const n = cameras?.shape.length ?? 0;
    const rigs = cameras ? cameras.rig.reduce((most, rig) => Math.max(most, rig + 1), 0) : 0;
    const width = MAX_CAMERAS * TEXELS_PER_CAMERA * 4;
    const data = new Float32Array(width * Math.max(1, Math.min(rigs, 2048)));
    for (let i = 3; i < data.length; i += 4 * TEXELS_PER_CAMERA) data[i] = -1;
    const used = new Uint8Array(rigs);
    this.count.fill(0);
    this.camerasPerRig = 1;
    for (let i = 0; cameras && i < n; ++i) {
      const rig = cameras.rig[i]!;
      const at = width * rig + used[rig]! * TEXELS_PER_CAMERA * 4;
      if (used[rig]! >= MAX_CAMERAS || at >= data.length) continue;
      this.camerasPerRig = Math.max(this.camerasPerRig, ++used[rig]!);
      const isSphere = Math.min(1, cameras.shape[i]!);
      ++this.count[isSphere]!;
      data.set(cameras.position.subarray(3 * i, 3 * i + 3), at);
      data[at + 3] = isSphere;
      for (let c = 0; c < 4; ++c) data.set(cameras.corners.subarray(12 * i + 3 * c, 12 * i + 3 * c + 3), at + 4 * (c + 1));
    }
    this.numRigs.value = Math.min(rigs, 2048);
    this.uniform.value.dispose();
    this.uniform.value = textureOf(data, data.length / width);
  }

  verticesPerInstance(isSphere: boolean): number {
    return this.camerasPerRig * (isSphere ? 6 * RING_SEGMENTS : PYRAMID.length);
  }

  /** Vertices of all cameras of a rig: (point, camera of the rig), and of spheres where on the rings. */
  outline(isSphere: boolean): InstancedBufferGeometry {
    const points: number[] = [];
    const ring: number[] = [];
    for (let camera = 0; camera < MAX_CAMERAS; ++camera) {
      for (let i = 0; i < (isSphere ? 6 * RING_SEGMENTS : PYRAMID.length); ++i) {
        points.push(isSphere ? 0 : PYRAMID[i]!, camera, 0);
        ring.push(...(isSphere ? onRing(i) : [0, 0, 0]));
      }
    }
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(Float32Array.from(points), 3));
    geometry.setAttribute("ring", new BufferAttribute(Float32Array.from(ring), 3));
    return geometry;
  }
}

/** Vertex i of three circles, each across one axis. */
function onRing(i: number): number[] {
  const axis = Math.floor(i / (2 * RING_SEGMENTS));
  const angle = (Math.ceil((i % (2 * RING_SEGMENTS)) / 2) * 2 * Math.PI) / RING_SEGMENTS;
  const point = [0, 0, 0];
  point[(axis + 1) % 3] = Math.cos(angle);
  point[(axis + 2) % 3] = Math.sin(angle);
  return point;
}

function textureOf(data: Float32Array<ArrayBuffer>, height: number): DataTexture {
  const texture = new DataTexture(data, MAX_CAMERAS * TEXELS_PER_CAMERA, height, RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}
