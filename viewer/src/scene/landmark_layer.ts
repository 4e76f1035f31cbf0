// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import {
  BufferAttribute, BufferGeometry, InstancedBufferGeometry, LineSegments, Points, ShaderMaterial, Vector2, Vector3, type IUniform, type Texture,
} from "three";
import type { LandmarkTable } from "../store/landmark_table";
import { NO_SUBMAP } from "../protocol";
import type { Palette } from "./palette";
import { edgePointFragment, edgePointVertex, pointFragment, pointVertex } from "./shaders";
import { instanced, instancedNormalized, normalized, Uploads } from "./upload";

export const COLOURINGS = ["image", "height", "age", "observations", "part"] as const;
export type Colouring = (typeof COLOURINGS)[number];

const NUM_SAMPLES = 4096;
/** Of a point, in pixels of the page: far away it can still be seen, close by it covers little. */
const SIZE_PX = { least: 2, most: 16 };

/** How the landmarks are looked at. */
export interface LandmarkView {
  /** Pixels of the screen in one of the page. */
  pixelRatio: number;
  /** Of the picture, in pixels of the screen. */
  height_px: number;
  /** Of a point, in units of the map. */
  worldSize: number;
  /** Distances between which points fade towards the background. */
  fog: { from: number; to: number };
}

/** All landmarks: one buffer, one draw call; one more for those on edges, if there are some. */
export class LandmarkLayer {
  readonly points: Points<BufferGeometry, ShaderMaterial>;
  readonly edges: LineSegments<InstancedBufferGeometry, ShaderMaterial>;
  /** Between which values the ramp runs: height in map units, frame, or observations. */
  readonly low_high = { height: new Vector2(0, 1), age: new Vector2(0, 1), observations: new Vector2(0, 1) };
  /** Of heights, a unit vector in the map's frame. */
  readonly down = new Vector3(0, 1, 0);
  private readonly positions: Uploads;
  private readonly others: Uploads;
  private readonly ofEdges: Uploads;
  private readonly uniforms: Record<string, IUniform>;
  private readonly samples = new Float32Array(NUM_SAMPLES);

  constructor(private readonly table: LandmarkTable, partPlaces: Texture) {
    const geometry = new BufferGeometry();
    this.positions = new Uploads([geometry]).bind("position", 3, () => table.position);
    this.others = new Uploads([geometry])
      .bind("frame", 1, () => table.frame)
      .bind("facts", 2, () => table.facts)
      .bind("colour", 4, () => table.colour, normalized);
    const edgeGeometry = new InstancedBufferGeometry();
    edgeGeometry.setAttribute("position", new BufferAttribute(Float32Array.of(-1, 0, 0, 1, 0, 0), 3));
    this.ofEdges = new Uploads([edgeGeometry])
      .bind("place", 3, () => table.position, instanced)
      .bind("half_", 3, () => table.half, instanced)
      .bind("frame", 1, () => table.frame, instanced)
      .bind("facts", 2, () => table.facts, instanced)
      .bind("colour", 4, () => table.colour, instancedNormalized);
    const uniforms: Record<string, IUniform> = {
      partPlaces: { value: partPlaces }, mode: { value: 1 }, range: { value: this.low_high.height },
      pointSize: { value: new Vector2() }, worldSize: { value: 0.02 }, viewHeight: { value: 1 }, fog: { value: new Vector2() },
      ramp: { value: [] }, parts: { value: [] }, ink: { value: null }, ground: { value: null }, dim: { value: 1 }, down: { value: this.down },
    };
    this.uniforms = uniforms;
    this.points = new Points(geometry, new ShaderMaterial({ vertexShader: pointVertex, fragmentShader: pointFragment, uniforms }));
    const ofEdges = new ShaderMaterial({ vertexShader: edgePointVertex, fragmentShader: edgePointFragment, uniforms });
    this.edges = new LineSegments(edgeGeometry, ofEdges);
    this.points.frustumCulled = this.edges.frustumCulled = false;
  }

  setPalette(palette: Palette): void {
    const { uniforms } = this;
    uniforms["ramp"]!.value = palette.ramp;
    uniforms["parts"]!.value = palette.parts;
    uniforms["ink"]!.value = palette.ink;
    uniforms["ground"]!.value = palette.ground;
  }

  setColouring(colouring: Colouring): void {
    const { uniforms } = this;
    uniforms["mode"]!.value = COLOURINGS.indexOf(colouring);
    if (colouring === "height" || colouring === "age" || colouring === "observations") {
      uniforms["range"]!.value = this.low_high[colouring];
    }
  }

  /** Lets other things stand out. */
  setDim(isDim: boolean): void {
    this.uniforms["dim"]!.value = isDim ? 0.22 : 1;
    for (const { material } of [this.points, this.edges]) {
      material.transparent = isDim;
      material.depthWrite = !isDim;
    }
  }

  setView({ pixelRatio, height_px, worldSize, fog }: LandmarkView): void {
    const { uniforms } = this;
    (uniforms["pointSize"]!.value as Vector2).set(SIZE_PX.least * pixelRatio, SIZE_PX.most * pixelRatio);
    uniforms["viewHeight"]!.value = 0.5 * height_px;
    uniforms["worldSize"]!.value = worldSize;
    (uniforms["fog"]!.value as Vector2).set(fog.from, fog.to);
  }

  sync(): boolean {
    const { table } = this;
    this.points.geometry.setDrawRange(0, table.slots.end);
    this.edges.geometry.instanceCount = table.slots.end;
    for (const uploads of [this.positions, this.others]) uploads.follow();
    const hasEdges = table.half.length > 0;
    if (hasEdges) this.ofEdges.follow();
    const upload = (uploads: Uploads) => (first: number, last: number) => {
      uploads.upload(first, last);
      if (hasEdges) this.ofEdges.upload(first, last);
    };
    const moved = table.movedSlots.take(table.slots.end, upload(this.positions));
    return table.changedSlots.take(table.slots.end, upload(this.others)) || moved;
  }

  /** Measures again what the ramps run between, on a sample. */
  measure(): void {
    const { table, low_high, down } = this;
    const place = new Vector3();
    this.percentiles((slot) => -place.fromArray(table.position, 3 * slot).dot(down), 0.03, 0.97, low_high.height);
    this.percentiles((slot) => table.frame[slot]!, 0, 1, low_high.age);
    this.percentiles((slot) => Math.log2(table.facts[2 * slot]!), 0.02, 0.98, low_high.observations);
  }

  private percentiles(valueOf: (slot: number) => number, low: number, high: number, out: Vector2): void {
    const { table, samples } = this;
    const step = Math.max(1, Math.floor(table.slots.end / NUM_SAMPLES));
    let count = 0;
    for (let slot = 0; slot < table.slots.end && count < NUM_SAMPLES; slot += step) {
      if (table.isAlive(slot) && table.facts[2 * slot + 1] !== NO_SUBMAP) samples[count++] = valueOf(slot);
    }
    if (count === 0) return;
    const sorted = samples.subarray(0, count).sort();
    out.set(sorted[Math.floor(low * (count - 1))]!, sorted[Math.floor(high * (count - 1))]!);
  }
}
