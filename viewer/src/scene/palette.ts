// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Color, LinearSRGBColorSpace } from "three";

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

/**
 * A colour in whatever form of CSS: the build writes #ffffff as #fff. The shaders write what they are given, without conversion:
 * colours stay as they are written in the style sheet.
 */
export function colourOf(text: string): Color {
  return new Color().setStyle(text.trim(), LinearSRGBColorSpace);
}

export function readPalette(): Palette {
  const style = getComputedStyle(document.documentElement);
  const colour = (name: string) => colourOf(style.getPropertyValue(`--${name}`));
  const list = (name: string, n: number) => Array.from({ length: n }, (_, i) => colour(`${name}-${i}`));
  return {
    ground: colour("ground"), ink: colour("ink"), grid: colour("grid"), trail: colour("trail"),
    keyframe: colour("keyframe"), covisibility: colour("covisibility"), loop: colour("loop"), lost: colour("lost"),
    selected: colour("selected"), ramp: list("ramp", NUM_RAMP), parts: list("part", NUM_PARTS),
  };
}
