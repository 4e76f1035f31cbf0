// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Vector3 } from "three";
import type { Scene } from "../scene/scene";
import { byId } from "./dom";

const LENGTH_PX = 22;
const LETTER_PX = 29;

/**
 * Which way the axes of the map's frame point in the view, and gravity where it is known: those of its first camera are x right, y down,
 * z forward.
 */
export class AxesFigure {
  private readonly axes = [...byId("axes").querySelectorAll("g")];
  private readonly direction = new Vector3();

  constructor(private readonly scene: Scene) {}

  draw(): void {
    const { gravity } = this.scene;
    this.axes.forEach((axis, i) => {
      const isAxis = i < 3;
      axis.toggleAttribute("hidden", !isAxis && !gravity);
      if (isAxis) this.direction.set(0, 0, 0).setComponent(i, 1);
      else if (gravity) this.direction.copy(gravity);
      const { x, y } = this.scene.viewDirection(this.direction);
      const place = (selector: string, names: [string, string], length: number) => {
        const element = axis.querySelector(selector)!;
        element.setAttribute(names[0], (length * x).toFixed(1));
        element.setAttribute(names[1], (-length * y).toFixed(1));
      };
      place("line", ["x2", "y2"], LENGTH_PX);
      place("text", ["x", "y"], LETTER_PX);
    });
  }
}
