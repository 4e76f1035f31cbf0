// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { BufferAttribute, BufferGeometry, LineSegments, Points, ShaderMaterial, type Vector3 } from "three";
import type { Palette } from "./palette";
import { plainFragment, plainVertex } from "./shaders";

const MAX_RAYS = 4096;

/** Rays from the selected keyframe to its landmarks, or from the selected landmark to those who see it. */
export class SelectionLayer {
  readonly lines: LineSegments<BufferGeometry, ShaderMaterial>;
  readonly dots: Points<BufferGeometry, ShaderMaterial>;
  private readonly rays = new Float32Array(6 * MAX_RAYS);
  private readonly ends = new Float32Array(3 * MAX_RAYS);
  private count = 0;

  constructor() {
    this.lines = new LineSegments(geometryOf(this.rays), plainMaterial(0.14));
    this.dots = new Points(geometryOf(this.ends), plainMaterial(1));
    this.lines.frustumCulled = this.dots.frustumCulled = false;
    this.finish();
  }

  setPalette(palette: Palette): void {
    this.lines.material.uniforms["colour"]!.value = palette.selected;
    this.dots.material.uniforms["colour"]!.value = palette.selected;
  }

  setPixelRatio(ratio: number): void {
    this.dots.material.uniforms["dotSize"]!.value = 3.5 * ratio;
  }

  clear(): void {
    this.count = 0;
  }

  add(from: Vector3, to: Vector3): void {
    if (this.count === MAX_RAYS) return;
    from.toArray(this.rays, 6 * this.count);
    to.toArray(this.rays, 6 * this.count + 3);
    to.toArray(this.ends, 3 * this.count);
    ++this.count;
  }

  finish(): void {
    for (const [object, vertices] of [[this.lines, 2 * this.count], [this.dots, this.count]] as const) {
      object.visible = this.count > 0;
      object.geometry.setDrawRange(0, vertices);
      object.geometry.getAttribute("position").needsUpdate = true;
    }
  }
}

function geometryOf(array: Float32Array): BufferGeometry {
  return new BufferGeometry().setAttribute("position", new BufferAttribute(array, 3));
}

function plainMaterial(opacity: number): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: plainVertex, fragmentShader: plainFragment, transparent: true, depthWrite: false, depthTest: false,
    uniforms: { colour: { value: null }, opacity: { value: opacity }, dotSize: { value: 4 } },
  });
}
