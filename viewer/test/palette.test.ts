// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, it } from "vitest";
import { colourOf } from "../src/scene/palette";

it("colours are what they are in every form that a style sheet may come to have", () => {
  for (const white of ["#ffffff", "#fff", " #FFF", "white", "rgb(255, 255, 255)"]) expect(colourOf(white).toArray()).toEqual([1, 1, 1]);
  for (const red of ["#ff0000", "#f00", "red", "rgb(255,0,0)"]) expect(colourOf(red).toArray()).toEqual([1, 0, 0]);
  expect(colourOf("#12181f").toArray().map((value) => Math.round(255 * value))).toEqual([0x12, 0x18, 0x1f]);
});

it("what is selected is white in the dark and nearly black in the light, as built", () => {
  const built = readFileSync(new URL("../dist/index.css", import.meta.url), "utf8");
  const selected = [...built.matchAll(/--selected: ?([^;}]+)/g)].map((found) => colourOf(found[1]!).getHexString("srgb-linear"));
  expect(selected).toEqual(["12181f", "ffffff"]);
});
