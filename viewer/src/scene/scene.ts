// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Group, LinearSRGBColorSpace, Quaternion, Scene as ThreeScene, Vector3, WebGLRenderer } from "three";
import type { Store } from "../store/store";
import { CameraShapes } from "./camera_shapes";
import { CurrentCamera } from "./current_camera";
import { Extent } from "./extent";
import { Ground } from "./ground";
import { KeyframeLayer } from "./keyframe_layer";
import { LandmarkLayer, type Colouring } from "./landmark_layer";
import { MarkerLayer } from "./marker_layer";
import { MeasureLayer } from "./measure_layer";
import { readPalette, type Palette } from "./palette";
import { Parts } from "./parts";
import { pick, type Picked } from "./picking";
import { SelectionLayer } from "./selection_layer";
import { TrailLayer } from "./trail_layer";
import { View, type ViewName } from "./view";

export const LAYERS = ["landmarks", "keyframes", "markers", "covisibility", "tree", "loops", "trajectory", "grid"] as const;
export type LayerName = (typeof LAYERS)[number];

const MEASURE_EVERY_MS = 700;

/** Which way is down in a map whose gravity is not known: that of its first camera. */
const DOWN = new Vector3(0, 1, 0);

/** The map in three dimensions. The group `world` turns it upright: the map's y points down, unless gravity tells. */
export class Scene {
  readonly view: View;
  readonly extent = new Extent();
  readonly ground = new Ground();
  readonly landmarks: LandmarkLayer;
  readonly parts = new Parts();
  readonly shown: Record<LayerName, boolean> = {
    landmarks: true, keyframes: true, markers: true, covisibility: false, tree: false, loops: true, trajectory: true, grid: true,
  };
  palette!: Palette;
  needsRender = true;
  /** Where it points to in the map's frame, unit; null where that is not known. */
  gravity: Vector3 | null = null;
  /** Null where the browser has no WebGL. */
  private readonly renderer: WebGLRenderer | null;
  private readonly scene = new ThreeScene();
  private readonly world = new Group();
  private readonly shapes = new CameraShapes();
  private readonly keyframes: KeyframeLayer;
  private readonly trail: TrailLayer;
  private readonly current: CurrentCamera;
  private readonly selection = new SelectionLayer();
  private readonly measurement = new MeasureLayer();
  readonly markers: MarkerLayer;
  private readonly subject = new Vector3();
  private readonly heading = new Vector3();
  private readonly rotation = new Quaternion();
  private readonly a = new Vector3();
  private readonly b = new Vector3();
  private camerasVersion = -1;
  private measuredVersion = -1;
  private measuredAt_ms = -Infinity;
  private selected: { from: Picked; to: number[] } | null = null;
  private isSelectionStale = false;
  private hasSubject = false;

  constructor(private readonly store: Store, private readonly canvas: HTMLCanvasElement) {
    this.renderer = makeRenderer(canvas);
    this.view = new View(canvas);
    this.landmarks = new LandmarkLayer(store.landmarks, this.parts.texture);
    this.keyframes = new KeyframeLayer(store.keyframes, this.shapes, this.parts.texture);
    this.markers = new MarkerLayer(store, this.parts);
    this.trail = new TrailLayer(store.trajectory, this.parts.texture);
    this.current = new CurrentCamera(this.shapes, this.parts.texture);
    const { covisibility, tree, loops } = this.keyframes.edges;
    this.world.add(this.markers.squares, this.markers.signs, this.measurement.line, this.measurement.dots);
    this.world.add(this.landmarks.points, this.landmarks.edges, covisibility, tree, this.trail.mesh, loops, ...this.keyframes.glyphs.meshes);
    this.world.add(this.selection.lines, this.selection.dots, ...this.current.glyphs.meshes);
    this.scene.add(this.ground.mesh, this.world);
    this.turnUpright();
    this.setPalette();
    this.view.controls.addEventListener("change", () => (this.needsRender = true));
  }

  /** Without it only the picture is missing. */
  get canDraw(): boolean {
    return this.renderer !== null;
  }

  get drawCalls(): number {
    return this.renderer?.info.render.calls ?? 0;
  }

  /** Length at the point that is looked at that is as long as a pixel of the page. */
  get unitsPerPixel(): number {
    return (2 * this.seenHeight) / Math.max(1, this.canvas.clientHeight);
  }

  setPalette(): void {
    this.palette = readPalette();
    this.renderer?.setClearColor(this.palette.ground);
    for (const layer of [this.landmarks, this.keyframes, this.trail, this.current, this.selection, this.ground, this.markers, this.measurement]) {
      layer.setPalette(this.palette);
    }
    this.needsRender = true;
  }

  setColouring(colouring: Colouring): void {
    this.landmarks.setColouring(colouring);
    this.keyframes.glyphs.set("byPart", colouring === "part");
    this.needsRender = true;
  }

  /** Shows the map with gravity downwards, a unit vector in its frame; null: that is not known. */
  setGravity(gravity: readonly number[] | null): void {
    if (gravity ? this.gravity?.equals(this.a.fromArray(gravity)) : !this.gravity) return;
    this.gravity = gravity && new Vector3().fromArray(gravity);
    this.turnUpright();
    this.measure();
  }

  setView(name: ViewName): void {
    const { extent, view } = this;
    if (name === "follow" && this.hasSubject) view.follow(this.subject, this.heading, 16 * extent.step);
    else if (name === "top") view.top(extent.centre, extent.radius);
    else view.orbit(extent.centre, extent.radius);
    this.needsRender = true;
  }

  resize(width: number, height: number): void {
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.renderer?.setPixelRatio(ratio);
    this.renderer?.setSize(width, height, false);
    this.view.setAspect(width / Math.max(1, height));
    this.needsRender = true;
  }

  pickAt(x_px: number, y_px: number): Picked | null {
    const { clientWidth, clientHeight } = this.canvas;
    const perPixel = { x: 2 / clientWidth, y: 2 / clientHeight };
    const at = { x: x_px * perPixel.x - 1, y: 1 - y_px * perPixel.y };
    return pick(this.store, this.parts, this.view.camera, this.world, at, perPixel, this.shown);
  }

  /** Marks an element, with rays to what belongs to it: landmarks of a keyframe, or keyframes that see a landmark. */
  select(from: Picked | null, to: number[] = []): void {
    this.selected = from && { from, to };
    this.landmarks.setDim(from !== null && to.length > 0);
    this.isSelectionStale = true;
  }

  goTo(picked: Picked): void {
    if (!this.placeOf(picked, this.a)) return;
    if (this.view.name === "follow") this.view.name = "orbit";
    this.view.goTo(this.world.localToWorld(this.a), 9 * this.extent.step);
  }

  goToPart(part: number): void {
    const radius = this.extent.sphere(this.store, this.parts, this.world, this.a, part);
    if (!Number.isFinite(radius)) return;
    if (this.view.name === "top") this.view.top(this.a, radius);
    else this.view.orbit(this.a, radius);
    this.needsRender = true;
  }

  /** How a direction of the map lies in the view: x right, y up, z towards who looks. */
  viewDirection(direction: Vector3): Vector3 {
    return direction.transformDirection(this.world.matrixWorld).transformDirection(this.view.camera.matrixWorldInverse);
  }

  /** Takes up what changed and draws where needed; `cursor` is the frame to show the camera at. True where it drew. */
  update(now_ms: number, dt_s: number, cursor: number, isLost: boolean): boolean {
    if (!this.renderer) return false;
    if (this.sync(now_ms)) {
      this.needsRender = true;
      this.isSelectionStale = this.selected !== null || this.isSelectionStale;
    }
    if (now_ms - this.measuredAt_ms > MEASURE_EVERY_MS && this.measuredVersion !== this.store.version) this.measure(now_ms);
    if (this.isSelectionStale) this.showSelection();
    this.placeCurrent(cursor, isLost);
    if (this.view.update(dt_s, this.hasSubject ? this.subject : null, this.extent.radius)) this.needsRender = true;
    if (!this.needsRender) return false;
    this.needsRender = false;
    this.draw(this.renderer, cursor);
    return true;
  }

  /** Measures at once, for when a whole map has come. */
  measure(now_ms = performance.now()): void {
    this.measuredAt_ms = now_ms;
    this.measuredVersion = this.store.version;
    if (this.parts.arrange(this.store)) this.markers.rebuild();
    this.landmarks.measure();
    this.extent.measure(this.store, this.parts, this.world, this.landmarks.low_high.height.x);
    this.needsRender = true;
  }

  screenshot(): Promise<Blob | null> {
    if (!this.renderer) return Promise.resolve(null);
    this.renderer.render(this.scene, this.view.camera);
    return new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
  }

  private turnUpright(): void {
    const down = this.gravity ?? DOWN;
    this.landmarks.down.copy(down);
    this.world.quaternion.setFromUnitVectors(down, DOWN).premultiply(this.rotation.set(1, 0, 0, 0));
    this.world.updateMatrixWorld();
  }

  private sync(now_ms: number): boolean {
    const { store } = this;
    const camerasChanged = this.camerasVersion !== store.camerasVersion;
    if (camerasChanged) {
      this.camerasVersion = store.camerasVersion;
      this.shapes.update(store.cameras);
    }
    const landmarks = this.landmarks.sync();
    const keyframes = this.keyframes.sync(now_ms);
    const markers = this.markers.sync();
    return this.trail.sync() || landmarks || keyframes || markers || camerasChanged;
  }

  private draw(renderer: WebGLRenderer, cursor: number): void {
    const { canvas, extent, view, shown } = this;
    const ratio = renderer.getPixelRatio();
    // What is looked at, and all in front of it, is clear.
    const from = view.camera.position.distanceTo(view.controls.target);
    const fog = { from, to: from + 1.2 * extent.radius };
    this.landmarks.setView({ pixelRatio: ratio, height_px: canvas.height, worldSize: 0.035 * extent.step, fog });
    this.landmarks.points.visible = shown.landmarks && this.store.landmarks.count > 0;
    this.landmarks.edges.visible = this.landmarks.points.visible && this.store.landmarks.numEdges > 0;
    this.markers.setView(ratio, canvas.height);
    this.markers.squares.visible = this.markers.signs.visible = shown.markers && this.markers.count > 0;
    this.measurement.setPixelRatio(ratio);
    this.trail.setView(canvas.width, canvas.height, ratio);
    this.trail.setCursor(cursor);
    this.trail.mesh.visible = shown.trajectory && this.store.trajectory.count > 1;
    this.selection.setPixelRatio(ratio);
    this.keyframes.glyphs.set("size", 0.4 * extent.step);
    this.keyframes.glyphs.show(shown.keyframes, this.store.keyframes.slots.end);
    this.current.glyphs.set("size", 0.9 * extent.step);
    const { covisibility, tree, loops } = this.keyframes.edges;
    covisibility.visible = shown.covisibility && covisibility.geometry.drawRange.count > 0;
    tree.visible = shown.tree && tree.geometry.drawRange.count > 0;
    loops.visible = shown.loops && loops.geometry.drawRange.count > 0;
    this.ground.place(view.controls.target, extent.floor, this.seenHeight);
    this.ground.mesh.visible = shown.grid && this.store.keyframes.count > 0;
    renderer.render(this.scene, view.camera);
  }

  /** Half of what is seen from bottom to top at the point that is looked at. */
  private get seenHeight(): number {
    const { camera, controls } = this.view;
    return camera.position.distanceTo(controls.target) * Math.tan((camera.fov * Math.PI) / 360);
  }

  private placeCurrent(cursor: number, isLost: boolean): void {
    const { trajectory } = this.store;
    const index = trajectory.lastPosed(Math.min(cursor, trajectory.count - 1));
    this.hasSubject = index >= 0;
    const wasVisible = this.current.isVisible;
    this.current.isVisible = this.hasSubject && this.shown.trajectory;
    if (index >= 0) {
      const rig = this.store.keyframes.count > 0 ? this.store.keyframes.facts[0]! : 0;
      this.parts.offset(trajectory.submap(index), this.b);
      this.subject.fromArray(trajectory.position, 3 * index).add(this.b);
      this.world.localToWorld(this.subject);
      this.rotation.fromArray(trajectory.rotation, 4 * index);
      this.heading.set(0, 0, 1).applyQuaternion(this.rotation).transformDirection(this.world.matrixWorld);
      const changed = this.current.set(trajectory, index, rig, isLost ? this.palette.lost : this.palette.trail);
      if (changed) this.needsRender = true;
    }
    this.current.show();
    if (wasVisible !== this.current.isVisible) this.needsRender = true;
  }

  private showSelection(): void {
    this.isSelectionStale = false;
    this.needsRender = true;
    this.selection.clear();
    const { selected } = this;
    const isKeyframe = selected?.from.kind === "keyframe";
    this.keyframes.glyphs.set("selected", isKeyframe ? this.store.keyframes.slots.find(selected.from.id) : -1);
    if (selected && this.placeOf(selected.from, this.a)) {
      if (!isKeyframe && selected.to.length === 0) this.selection.add(this.a, this.a);
      const kind = isKeyframe ? "landmark" : "keyframe";
      for (const id of selected.to) {
        if (this.placeOf({ kind, id }, this.b)) this.selection.add(this.a, this.b);
      }
    }
    this.selection.finish();
  }

  /** Shows what is measured: one place, or two and the line between them. */
  showMeasured(places: Vector3[]): void {
    if (this.measurement.set(places)) this.needsRender = true;
  }

  /** Where an element is drawn, in the frame of `world`. */
  placeOf({ kind, id }: Picked, out: Vector3): boolean {
    const table = kind === "keyframe" ? this.store.keyframes : this.store.landmarks;
    const slot = table.slots.find(id);
    if (slot < 0) return false;
    this.parts.offset(table.facts[2 * slot + 1]!, out);
    out.x += table.position[3 * slot]!;
    out.y += table.position[3 * slot + 1]!;
    out.z += table.position[3 * slot + 2]!;
    return true;
  }
}

function makeRenderer(canvas: HTMLCanvasElement): WebGLRenderer | null {
  try {
    const renderer = new WebGLRenderer({ canvas, antialias: window.devicePixelRatio < 2, powerPreference: "high-performance" });
    renderer.outputColorSpace = LinearSRGBColorSpace; // The colours of the style sheet, as they are.
    return renderer;
  } catch {
    return null;
  }
}
