// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Color } from "three";

/** Colours of the scene. They are the custom properties of style.css, which know about dark and light. */
export interface Palette {
  ground: Color;
  ink: Color;
  grid: Color;
  trail: Color;
  keyframe: Color;
  covisibility: Color;
  loop: Color;
  lost: Color;
  selected: Color;
  /** Low to high, for height, age and observations. */
  ramp: Color[];
  /** One after the other for sub-maps. */
  parts: Color[];
}

export const NUM_RAMP = 5;
export const NUM_PARTS = 8;

export function readPalette(): Palette {
  const style = getComputedStyle(document.documentElement);
  // The shaders write what they are given, without conversion: colours stay as they are written in the style sheet.
  const colour = (name: string) => {
    const value = new Color();
    const digits = parseInt(style.getPropertyValue(`--${name}`).trim().slice(1), 16);
    return value.setRGB(((digits >> 16) & 255) / 255, ((digits >> 8) & 255) / 255, (digits & 255) / 255);
  };
  const list = (name: string, n: number) => Array.from({ length: n }, (_, i) => colour(`${name}-${i}`));
  return {
    ground: colour("ground"), ink: colour("ink"), grid: colour("grid"), trail: colour("trail"),
    keyframe: colour("keyframe"), covisibility: colour("covisibility"), loop: colour("loop"), lost: colour("lost"),
    selected: colour("selected"), ramp: list("ramp", NUM_RAMP), parts: list("part", NUM_PARTS),
  };
}
