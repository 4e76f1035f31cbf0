// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Mesh, PlaneGeometry, ShaderMaterial, Vector2, type Vector3 } from "three";
import type { Palette } from "./palette";
import { gridFragment, gridVertex } from "./shaders";

/** A faint graticule below the map, whose mesh is a power of ten of the map's unit. */
export class Ground {
  readonly mesh: Mesh<PlaneGeometry, ShaderMaterial>;
  spacing = 1;

  constructor() {
    const geometry = new PlaneGeometry(2, 2).rotateX(-Math.PI / 2);
    const material = new ShaderMaterial({
      vertexShader: gridVertex, fragmentShader: gridFragment, transparent: true, depthWrite: false, side: 2,
      uniforms: { colour: { value: null }, spacing: { value: 1 }, reach: { value: 10 }, centre: { value: new Vector2() } },
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = -1;
  }

  setPalette(palette: Palette): void {
    this.mesh.material.uniforms["colour"]!.value = palette.grid;
  }

  /** Puts it under what is in sight: around `target`, `height` high, for a view that sees `extent`. */
  place(target: Vector3, height: number, extent: number): void {
    const reach = 3 * extent;
    this.spacing = 10 ** Math.floor(Math.log10(Math.max(extent, 1e-6) * 0.6));
    const { uniforms } = this.mesh.material;
    uniforms["spacing"]!.value = this.spacing;
    uniforms["reach"]!.value = reach;
    (uniforms["centre"]!.value as Vector2).set(target.x, target.z);
    this.mesh.position.set(target.x, height, target.z);
    this.mesh.scale.set(reach, 1, reach);
  }
}
