// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import {
  BufferAttribute, DynamicDrawUsage, InstancedBufferGeometry, InstancedInterleavedBuffer, InterleavedBufferAttribute, Mesh,
  ShaderMaterial, Vector2, type Texture, type TypedArray,
} from "three";
import type { TrajectoryTable } from "../store/trajectory_table";
import type { Palette } from "./palette";
import { trailFragment, trailVertex } from "./shaders";

/** The way that the camera took: one draw call. Each segment reads the poses of two neighbours out of the same buffer. */
export class TrailLayer {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  private positions!: InstancedInterleavedBuffer;
  private facts!: InstancedInterleavedBuffer;

  constructor(private readonly table: TrajectoryTable, partPlaces: Texture) {
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(Float32Array.of(0, -1, 0, 1, -1, 0, 0, 1, 0, 1, 1, 0), 3));
    geometry.setIndex([0, 1, 2, 2, 1, 3]);
    const material = new ShaderMaterial({
      vertexShader: trailVertex, fragmentShader: trailFragment, transparent: true, side: 2,
      uniforms: {
        partPlaces: { value: partPlaces }, viewport: { value: new Vector2(1, 1) }, width: { value: 2.5 },
        cursor: { value: 0 }, colour: { value: null }, filledColour: { value: null },
      },
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.follow();
  }

  setPalette(palette: Palette): void {
    this.mesh.material.uniforms["colour"]!.value = palette.trail;
    this.mesh.material.uniforms["filledColour"]!.value = palette.keyframe;
  }

  setView(width_px: number, height_px: number, pixelRatio: number): void {
    (this.mesh.material.uniforms["viewport"]!.value as Vector2).set(width_px, height_px);
    this.mesh.material.uniforms["width"]!.value = 2.6 * pixelRatio;
  }

  /** What comes after this frame is drawn faintly. */
  setCursor(index: number): void {
    this.mesh.material.uniforms["cursor"]!.value = index;
  }

  sync(): boolean {
    const { table } = this;
    this.mesh.geometry.instanceCount = Math.max(0, table.count - 1);
    if (this.positions.array !== table.position || this.facts.array !== table.facts) this.follow();
    return table.dirty.take(table.count, this.upload);
  }

  private readonly upload = (first: number, last: number): void => {
    this.positions.addUpdateRange(3 * first, 3 * (last - first));
    this.facts.addUpdateRange(2 * first, 2 * (last - first));
    this.positions.needsUpdate = true;
    this.facts.needsUpdate = true;
  };

  private follow(): void {
    const { geometry } = this.mesh;
    geometry.dispose();
    this.positions = interleaved(this.table.position, 3);
    this.facts = interleaved(this.table.facts, 2);
    geometry.setAttribute("from", new InterleavedBufferAttribute(this.positions, 3, 0));
    geometry.setAttribute("to", new InterleavedBufferAttribute(this.positions, 3, 3));
    geometry.setAttribute("fromFacts", new InterleavedBufferAttribute(this.facts, 2, 0));
    geometry.setAttribute("toFacts", new InterleavedBufferAttribute(this.facts, 2, 2));
  }
}

function interleaved(array: TypedArray, stride: number): InstancedInterleavedBuffer {
  const buffer = new InstancedInterleavedBuffer(array, stride);
  buffer.setUsage(DynamicDrawUsage);
  return buffer;
}
