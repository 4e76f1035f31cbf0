// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Color, DataTexture, Vector2 } from "three";
import { expect, it } from "vitest";
import { Kind } from "../src/protocol";
import { LandmarkLayer } from "../src/scene/landmark_layer";
import { type Palette } from "../src/scene/palette";
import { Store } from "../src/store/store";

const layer = () => new LandmarkLayer(new Store().landmarks, new DataTexture());

it("points are as large on a dense screen as on another, and fade where the view says", () => {
  const landmarks = layer();
  const { uniforms } = landmarks.points.material;
  const sizes = [1, 2].map((pixelRatio) => {
    landmarks.setView({ pixelRatio, height_px: 600 * pixelRatio, worldSize: 0.1, fog: { from: 3, to: 8 } });
    return { pointSize: (uniforms["pointSize"]!.value as Vector2).clone(), height: uniforms["viewHeight"]!.value as number };
  });
  expect(sizes[1]!.pointSize).toEqual(sizes[0]!.pointSize.clone().multiplyScalar(2));
  expect(sizes[1]!.height).toBe(2 * sizes[0]!.height);
  // Between its limits a point grows as one comes closer: they are far apart.
  expect(sizes[0]!.pointSize.y).toBeGreaterThan(5 * sizes[0]!.pointSize.x);
  expect(uniforms["worldSize"]!.value).toBe(0.1);
  expect(uniforms["fog"]!.value).toEqual(new Vector2(3, 8));
});

it("points fade towards the background of the palette", () => {
  const landmarks = layer();
  const palette = { ground: new Color(0.1, 0.2, 0.3), ramp: [] as Color[], parts: [] as Color[], ink: new Color() } as Palette;
  landmarks.setPalette(palette);
  expect(landmarks.points.material.uniforms["ground"]!.value).toBe(palette.ground);
});

it("heights are against what is down", () => {
  const { landmarks: table } = new Store();
  const id = Uint32Array.of(0, 1);
  const others = { frame: id, observations: Uint16Array.of(2, 2), submap: new Uint16Array(2), colour: new Uint8Array(8) };
  table.upsert({ kind: Kind.Landmarks, id, position: Float32Array.of(1, 2, 3, 4, 6, 8), ...others });
  const landmarks = new LandmarkLayer(table, new DataTexture());
  const { height } = landmarks.low_high;
  landmarks.measure();
  expect(height.toArray()).toEqual([-6, -6]);
  landmarks.down.set(0, 0, -1);
  landmarks.measure();
  expect(height.toArray()).toEqual([3, 3]);
});
