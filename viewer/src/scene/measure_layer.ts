// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { BufferAttribute, BufferGeometry, LineSegments, Points, ShaderMaterial, type Vector3 } from "three";
import type { Palette } from "./palette";
import { plainFragment, plainVertex } from "./shaders";

/** The places that a length is measured between, and the line from one to the other. */
export class MeasureLayer {
  readonly line: LineSegments<BufferGeometry, ShaderMaterial>;
  readonly dots: Points<BufferGeometry, ShaderMaterial>;
  private readonly positions = new BufferAttribute(new Float32Array(6), 3);

  constructor() {
    const geometry = new BufferGeometry().setAttribute("position", this.positions);
    this.line = new LineSegments(geometry, materialOf());
    this.dots = new Points(geometry.clone().setAttribute("position", this.positions), materialOf());
    this.line.frustumCulled = this.dots.frustumCulled = false;
    this.set([]);
  }

  setPalette(palette: Palette): void {
    for (const { material } of [this.line, this.dots]) material.uniforms["colour"]!.value = palette.trail;
  }

  setPixelRatio(ratio: number): void {
    this.dots.material.uniforms["dotSize"]!.value = 9 * ratio;
  }

  /** At most two; true where they are others than before. */
  set(places: Vector3[]): boolean {
    const values = places.flatMap((place) => place.toArray());
    const isSame = values.every((value, i) => Math.fround(value) === this.positions.array[i]);
    if (isSame && this.dots.geometry.drawRange.count === places.length) return false;
    this.positions.array.set(values);
    this.positions.needsUpdate = true;
    this.line.visible = places.length === 2;
    this.dots.visible = places.length > 0;
    this.dots.geometry.setDrawRange(0, places.length);
    return true;
  }
}

function materialOf(): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: plainVertex, fragmentShader: plainFragment, transparent: true, depthWrite: false, depthTest: false,
    uniforms: { colour: { value: null }, opacity: { value: 1 }, dotSize: { value: 9 } },
  });
}
