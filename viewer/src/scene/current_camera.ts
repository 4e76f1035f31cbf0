// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { InstancedBufferAttribute, type Color, type Texture } from "three";
import type { TrajectoryTable } from "../store/trajectory_table";
import type { CameraShapes } from "./camera_shapes";
import { Glyphs } from "./keyframe_layer";
import type { Palette } from "./palette";

/** The camera at the frame that is shown. */
export class CurrentCamera {
  readonly glyphs: Glyphs;
  isVisible = false;
  private readonly place = new InstancedBufferAttribute(new Float32Array(3), 3);
  private readonly rotation = new InstancedBufferAttribute(new Float32Array(4), 4);
  private readonly facts = new InstancedBufferAttribute(new Uint16Array(2), 2);
  private colour: Color | null = null;

  constructor(shapes: CameraShapes, partPlaces: Texture) {
    this.glyphs = new Glyphs(shapes, partPlaces);
    this.glyphs.set("smallest", 0.035);
    this.glyphs.set("largest", 0.07);
    this.glyphs.set("selected", 0); // It is drawn as strongly as the selected one.
    for (const geometry of this.glyphs.geometries) {
      geometry.setAttribute("place", this.place);
      geometry.setAttribute("rotation", this.rotation);
      geometry.setAttribute("facts", this.facts);
    }
    for (const mesh of this.glyphs.meshes) mesh.material.depthTest = false;
  }

  setPalette(palette: Palette): void {
    this.colour = null;
    this.glyphs.set("colour", palette.trail);
    this.glyphs.set("selectedColour", palette.trail);
    this.glyphs.set("parts", palette.parts);
  }

  show(): void {
    this.glyphs.show(this.isVisible, 1);
  }

  /** True where it moved or got another colour. */
  set(table: TrajectoryTable, index: number, rig: number, colour: Color): boolean {
    let changed = this.colour !== colour || this.facts.array[0] !== rig || this.facts.array[1] !== table.submap(index);
    for (let k = 0; k < 3; ++k) changed ||= this.place.array[k] !== table.position[3 * index + k];
    for (let k = 0; k < 4; ++k) changed ||= this.rotation.array[k] !== table.rotation[4 * index + k];
    if (!changed) return false;
    if (this.colour !== colour) this.glyphs.set("selectedColour", colour);
    this.colour = colour;
    for (let k = 0; k < 3; ++k) this.place.array[k] = table.position[3 * index + k]!;
    for (let k = 0; k < 4; ++k) this.rotation.array[k] = table.rotation[4 * index + k]!;
    this.facts.array[0] = rig;
    this.facts.array[1] = table.submap(index);
    for (const attribute of [this.place, this.rotation, this.facts]) attribute.needsUpdate = true;
    return true;
  }
}
