// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, LinearFilter, Mesh, Points, ShaderMaterial, Vector3 } from "three";
import type { Markers } from "../protocol";
import type { Store } from "../store/store";
import type { Palette } from "./palette";
import type { Parts } from "./parts";
import { markerFragment, markerSignFragment, markerSignVertex, markerVertex } from "./shaders";

/** Numbers are drawn for so many markers; the others are black squares. */
const MOST_NUMBERS = 1023;
const CELL_PX = 64;
/** Of what stands for a marker that is too far away, in pixels of the page. */
const SIGN_PX = 20;

/** Markers as squares with their numbers, where they are and as large as they are; smaller ones as signs that can still be read. */
export class MarkerLayer {
  readonly squares: Mesh<BufferGeometry, ShaderMaterial>;
  readonly signs: Points<BufferGeometry, ShaderMaterial>;
  count = 0;
  private readonly canvas = document.createElement("canvas");
  private readonly numbers = new CanvasTexture(this.canvas);
  private readonly uniforms = { numbers: { value: this.numbers }, cells: { value: 1 }, signSize: { value: 1 }, viewHeight: { value: 1 } };
  private shown: Markers | null = null;
  private palette: Palette | null = null;

  constructor(private readonly store: Store, private readonly parts: Parts) {
    const { uniforms } = this;
    this.numbers.minFilter = LinearFilter;
    this.numbers.generateMipmaps = false;
    this.squares = new Mesh(new BufferGeometry(), new ShaderMaterial({
      vertexShader: markerVertex, fragmentShader: markerFragment, uniforms, side: DoubleSide,
    }));
    this.signs = new Points(new BufferGeometry(), new ShaderMaterial({
      vertexShader: markerSignVertex, fragmentShader: markerSignFragment, uniforms, depthTest: false, transparent: true,
    }));
    this.squares.frustumCulled = this.signs.frustumCulled = false;
  }

  setPalette(palette: Palette): void {
    this.palette = palette;
    this.rebuild();
  }

  setView(pixelRatio: number, height_px: number): void {
    this.uniforms.signSize.value = SIGN_PX * pixelRatio;
    this.uniforms.viewHeight.value = 0.5 * height_px;
  }

  /** True where there are others than before. */
  sync(): boolean {
    if (this.shown === this.store.markers) return false;
    this.rebuild();
    return true;
  }

  /** Anew, also where parts of the map were put elsewhere. */
  rebuild(): void {
    const { markers } = this.store;
    this.shown = markers;
    this.count = markers?.id.length ?? 0;
    if (!markers || this.count === 0) return;
    const cells = Math.ceil(Math.sqrt(Math.min(this.count, MOST_NUMBERS) + 1));
    this.uniforms.cells.value = cells;
    this.drawNumbers(markers, cells);
    this.place(markers, cells);
  }

  private place(markers: Markers, cells: number): void {
    const n = this.count;
    const corners = new Float32Array(12 * n);
    const middles = new Float32Array(3 * n);
    const sides = new Float32Array(n);
    const ofCorners = new Float32Array(8 * n);
    const ofMiddles = new Float32Array(2 * n);
    const insides = new Float32Array(8 * n);
    const index = new Uint32Array(6 * n);
    const offset = new Vector3();
    for (let i = 0; i < n; ++i) {
      this.parts.offset(markers.submap[i]!, offset);
      const cell = Math.min(i, cells * cells - 1);
      ofMiddles.set([cell % cells, Math.floor(cell / cells)], 2 * i);
      for (let k = 0; k < 4; ++k) {
        for (let axis = 0; axis < 3; ++axis) {
          const value = markers.corners[12 * i + 3 * k + axis]! + offset.getComponent(axis);
          corners[12 * i + 3 * k + axis] = value;
          middles[3 * i + axis]! += 0.25 * value;
        }
        ofCorners.set([cell % cells, Math.floor(cell / cells)], 8 * i + 2 * k);
      }
      insides.set([0, 1, 1, 1, 1, 0, 0, 0], 8 * i);
      index.set([4 * i, 4 * i + 3, 4 * i + 1, 4 * i + 1, 4 * i + 3, 4 * i + 2], 6 * i);
      const at = (k: number) => new Vector3().fromArray(corners, 12 * i + 3 * k);
      sides[i] = at(0).distanceTo(at(1));
    }
    this.squares.geometry.dispose();
    this.squares.geometry = new BufferGeometry()
      .setAttribute("position", new BufferAttribute(corners, 3))
      .setAttribute("cell", new BufferAttribute(ofCorners, 2))
      .setAttribute("corner", new BufferAttribute(insides, 2))
      .setIndex(new BufferAttribute(index, 1));
    this.signs.geometry.dispose();
    this.signs.geometry = new BufferGeometry()
      .setAttribute("position", new BufferAttribute(middles, 3))
      .setAttribute("cell", new BufferAttribute(ofMiddles, 2))
      .setAttribute("side", new BufferAttribute(sides, 1));
  }

  private drawNumbers(markers: Markers, cells: number): void {
    const { canvas } = this;
    canvas.width = canvas.height = CELL_PX * cells;
    const context = canvas.getContext("2d")!;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const surveyed = this.palette ? `#${this.palette.trail.getHexString("srgb-linear")}` : "#dd5a1f";
    for (let cell = 0; cell < cells * cells; ++cell) {
      const x = CELL_PX * (cell % cells);
      const y = CELL_PX * (cells - 1 - Math.floor(cell / cells));
      const isNumbered = cell < Math.min(this.count, MOST_NUMBERS);
      context.fillStyle = isNumbered && markers.is_surveyed[cell] ? surveyed : "#ffffff";
      context.fillRect(x, y, CELL_PX, CELL_PX);
      context.fillStyle = "#14191c";
      context.fillRect(x + 6, y + 6, CELL_PX - 12, CELL_PX - 12);
      if (!isNumbered) continue;
      const text = String(markers.id[cell]);
      context.fillStyle = "#ffffff";
      context.font = `600 ${text.length < 3 ? 36 : text.length < 4 ? 25 : 19}px sans-serif`;
      context.fillText(text, x + CELL_PX / 2, y + CELL_PX / 2 + 2);
    }
    // The canvas may have another size than the texture in the graphics card.
    this.numbers.dispose();
    this.numbers.needsUpdate = true;
  }
}
