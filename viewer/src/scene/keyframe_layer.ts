// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import {
  BufferAttribute, BufferGeometry, InstancedBufferGeometry, LineSegments, ShaderMaterial, DynamicDrawUsage, type Texture,
} from "three";
import type { KeyframeTable } from "../store/keyframe_table";
import { grown } from "../store/slots";
import type { CameraShapes } from "./camera_shapes";
import type { Palette } from "./palette";
import { edgeVertex, glyphFragment, glyphVertex, plainFragment } from "./shaders";
import { instanced, Uploads } from "./upload";

/** Edges are listed anew at most so often. */
const EDGES_EVERY_MS = 300;

/** Outlines of the cameras of many poses: pyramids in one draw call, spheres in another. */
export class Glyphs {
  readonly meshes: LineSegments<InstancedBufferGeometry, ShaderMaterial>[] = [];
  readonly geometries: InstancedBufferGeometry[] = [];

  constructor(private readonly shapes: CameraShapes, partPlaces: Texture) {
    for (const isSphere of [false, true]) {
      const geometry = shapes.outline(isSphere);
      const material = new ShaderMaterial({
        vertexShader: glyphVertex, fragmentShader: glyphFragment, transparent: true, depthWrite: false,
        uniforms: {
          partPlaces: { value: partPlaces }, cameras: shapes.uniform, rigs: shapes.numRigs, size: { value: 0.1 },
          smallest: { value: 0.012 }, largest: { value: 0.05 }, isSphere: { value: isSphere ? 1 : 0 }, selected: { value: -1 },
          colour: { value: null }, selectedColour: { value: null }, byPart: { value: false }, parts: { value: [] },
        },
      });
      const mesh = new LineSegments(geometry, material);
      mesh.frustumCulled = false;
      this.meshes.push(mesh);
      this.geometries.push(geometry);
    }
  }

  set(name: string, value: unknown): void {
    for (const mesh of this.meshes) mesh.material.uniforms[name]!.value = value;
  }

  show(isVisible: boolean, count: number): void {
    this.meshes.forEach((mesh, i) => {
      mesh.visible = isVisible && count > 0 && this.shapes.count[i]! > 0;
      mesh.geometry.instanceCount = count;
      mesh.geometry.setDrawRange(0, this.shapes.verticesPerInstance(i === 1));
    });
  }
}

type EdgeName = "covisibility" | "tree" | "loops";

/** Keyframes and the edges between them; all edges share one buffer of positions. */
export class KeyframeLayer {
  readonly glyphs: Glyphs;
  readonly edges: Record<EdgeName, LineSegments<BufferGeometry, ShaderMaterial>>;
  private readonly forGlyphs: Uploads;
  private readonly forEdges: Uploads;
  private edgeVersion = -1;
  private edgesAt_ms = -Infinity;
  private listed = new Uint32Array(1024);
  private numListed = 0;

  constructor(private readonly table: KeyframeTable, shapes: CameraShapes, partPlaces: Texture) {
    this.glyphs = new Glyphs(shapes, partPlaces);
    this.edges = { covisibility: edgeLines(partPlaces, 0.35), tree: edgeLines(partPlaces, 0.8), loops: edgeLines(partPlaces, 1) };
    this.forGlyphs = new Uploads(this.glyphs.geometries)
      .bind("place", 3, () => table.position, instanced)
      .bind("rotation", 4, () => table.rotation, instanced)
      .bind("facts", 2, () => table.facts, instanced);
    this.forEdges = new Uploads(Object.values(this.edges).map((lines) => lines.geometry))
      .bind("position", 3, () => table.position)
      .bind("facts", 2, () => table.facts);
  }

  setPalette(palette: Palette): void {
    this.glyphs.set("colour", palette.keyframe);
    this.glyphs.set("selectedColour", palette.selected);
    this.glyphs.set("parts", palette.parts);
    this.edges.covisibility.material.uniforms["colour"]!.value = palette.covisibility;
    this.edges.tree.material.uniforms["colour"]!.value = palette.covisibility;
    this.edges.loops.material.uniforms["colour"]!.value = palette.loop;
  }

  sync(now_ms: number): boolean {
    const { table } = this;
    // Both kinds of attributes show the same arrays: the changed places are taken once and told to both.
    this.forEdges.follow();
    this.forGlyphs.follow();
    const changed = table.dirty.take(table.slots.end, (first, last) => {
      this.forEdges.upload(first, last);
      this.forGlyphs.upload(first, last);
    });
    if (this.edgeVersion === table.edgeVersion || now_ms - this.edgesAt_ms < EDGES_EVERY_MS) return changed;
    this.edgesAt_ms = now_ms;
    this.edgeVersion = table.edgeVersion;
    this.listEdges();
    return true;
  }

  private listEdges(): void {
    const { table, edges } = this;
    this.numListed = 0;
    for (let slot = 0; slot < table.slots.end; ++slot) {
      if (table.isAlive(slot)) this.list(slot, table.slots.find(table.parent[slot]!));
    }
    this.giveTo(edges.tree.geometry);
    for (const [id, others] of table.older) {
      const slot = table.slots.find(id);
      for (let i = 0; slot >= 0 && i < others.length; ++i) this.list(slot, table.slots.find(others[i]!));
    }
    this.giveTo(edges.covisibility.geometry);
    for (let i = 0; i < table.loops.length; i += 2) {
      const slot = table.slots.find(table.loops[i]!);
      if (slot >= 0) this.list(slot, table.slots.find(table.loops[i + 1]!));
    }
    this.giveTo(edges.loops.geometry);
  }

  private list(from: number, to: number): void {
    if (to < 0) return;
    if (this.numListed + 2 > this.listed.length) this.listed = grown(this.listed, this.numListed + 2);
    this.listed[this.numListed++] = from;
    this.listed[this.numListed++] = to;
  }

  /**
   * Puts the listed slots into the index of a geometry; its buffer is used again as long as it is large enough. The geometry must not be
   * disposed of: that would take the buffers that it shares with others, too.
   */
  private giveTo(geometry: BufferGeometry): void {
    const slots = this.listed.subarray(0, this.numListed);
    let index = geometry.getIndex();
    if (!index || index.count < slots.length) {
      index = new BufferAttribute(new Uint32Array(Math.max(256, 2 * slots.length)), 1).setUsage(DynamicDrawUsage);
      geometry.setIndex(index);
    }
    (index.array as Uint32Array).set(slots);
    index.clearUpdateRanges();
    index.addUpdateRange(0, slots.length);
    index.needsUpdate = true;
    geometry.setDrawRange(0, slots.length);
    this.numListed = 0;
  }
}

function edgeLines(partPlaces: Texture, opacity: number): LineSegments<BufferGeometry, ShaderMaterial> {
  const material = new ShaderMaterial({
    vertexShader: edgeVertex, fragmentShader: plainFragment, transparent: true, depthWrite: false,
    uniforms: { partPlaces: { value: partPlaces }, colour: { value: null }, opacity: { value: opacity } },
  });
  const lines = new LineSegments(new BufferGeometry(), material);
  lines.frustumCulled = false;
  return lines;
}
