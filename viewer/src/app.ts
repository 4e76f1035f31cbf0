// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Connection, type ConnectionState, type Listener } from "./connection";
import { decode, Kind } from "./protocol";
import { publish } from "./report";
import { Scene } from "./scene/scene";
import type { ViewName } from "./scene/view";
import { Store } from "./store/store";
import type { Hello, Status } from "./text_messages";
import { CalibrationPanel } from "./ui/calibration_panel";
import { CameraPanel } from "./ui/camera_panel";
import { Controls } from "./ui/controls";
import { AxesFigure } from "./ui/axes_figure";
import { byId, Choice, setIcon, setText } from "./ui/dom";
import { ImuPanel } from "./ui/imu_panel";
import { Inspector } from "./ui/inspector";
import { Legend } from "./ui/legend";
import { Measure } from "./ui/measure";
import { Notice } from "./ui/notice";
import { Places } from "./ui/places";
import { SessionPanel } from "./ui/session_panel";
import { Timeline } from "./ui/timeline";

const PANELS_EVERY_MS = 200;
/** A frame that takes longer is slow. */
const SLOW_MS = 70;

/** The page: takes messages, keeps the store, and shows it. */
export class App implements Listener {
  readonly store = new Store();
  readonly connection = new Connection(this);
  readonly scene = new Scene(this.store, byId<HTMLCanvasElement>("scene"));
  readonly measure = new Measure(this.scene, this.store, this.connection);
  readonly inspector = new Inspector(this.scene, this.store, this.connection, this.measure);
  readonly timeline = new Timeline(this.store, this.measure, () => (this.panelsAt_ms = 0));
  readonly report = publish(this);
  connectionState: ConnectionState = "connecting";
  hello: Hello | null = null;
  status: Status | null = null;
  private readonly session = new SessionPanel();
  private readonly controls = new Controls(this.connection);
  private readonly camera = new CameraPanel();
  private readonly calibration = new CalibrationPanel();
  private readonly imu = new ImuPanel();
  private readonly legend = new Legend(this.scene, this.measure);
  private readonly axes = new AxesFigure(this.scene);
  private readonly places = new Places(this.store, {
    goToPart: (part) => this.goToPart(part),
    goToKeyframe: (id) => void this.inspector.select({ kind: "keyframe", id }, true),
  });
  private readonly notice = new Notice();
  private readonly viewChoice: Choice<ViewName>;
  private retryAt_ms = 0;
  private before_ms = performance.now();
  private drawnAt_ms = performance.now();
  private restUntil_ms = 0;
  private hasDrawn = false;
  private panelsAt_ms = 0;
  private beganAt_ms = 0;
  private isFitted = false;
  private isUserView = false;
  /** Pixels of the screen in one of the page, as the scene knows it. */
  private density = window.devicePixelRatio;

  constructor() {
    const views = [["follow", "Follow"], ["orbit", "Orbit"], ["top", "Top"]] as const;
    this.viewChoice = new Choice<ViewName>(byId("view-choice"), views, (name) => this.setView(name, true));
    this.setUpButtons();
    this.setUpPicking();
    new ResizeObserver(() => this.resize()).observe(byId("stage"));
  }

  get colouring(): string {
    return this.legend.colouring;
  }

  start(): void {
    this.setTheme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
    this.viewChoice.set("orbit");
    this.connection.connect();
    requestAnimationFrame(this.tick);
  }

  onState(state: ConnectionState, retryAt_ms: number): void {
    this.connectionState = state;
    this.retryAt_ms = retryAt_ms;
    byId("app").dataset["connection"] = state;
    if (state === "waiting" || state === "refused") this.session.setGone(this.status, this.store.landmarks.count > 0);
    this.panelsAt_ms = 0;
  }

  onHello(hello: Hello): void {
    this.hello = hello;
    this.session.setHello(hello);
    this.controls.setHello(hello);
    this.timeline.setHello(hello);
    this.measure.setHello(hello);
    this.inspector.hasImages = hello.keyframe_images === true;
    this.camera.clear();
  }

  onStatus(status: Status): void {
    this.status = status;
    this.session.setStatus(status);
    this.controls.setStatus(status);
    this.calibration.show(status.calibration);
    this.imu.show(status.imu);
    this.measure.metricPart = status.imu?.metric_submap ?? null;
    // What was known goes on while a new part is compared.
    if (status.imu?.gravity || status.keyframes === 0) this.scene.setGravity(status.imu?.gravity ?? null);
    this.report.statusTaken(status);
  }

  onBinary(data: ArrayBuffer): void {
    const start = performance.now();
    const message = decode(data);
    if (message) {
      this.store.apply(message);
      if (message.kind === Kind.Begin) this.begin(start);
      else if (message.kind === Kind.End) this.end();
      else if (message.kind === Kind.Frame) void this.camera.show(message);
      else if (message.kind === Kind.KeyframeImage) this.connection.takeImage(message);
    }
    this.report.messageTaken(performance.now() - start);
  }

  private begin(now_ms: number): void {
    this.beganAt_ms = now_ms;
    this.isFitted = false;
    void this.inspector.select(null);
    this.measure.clear();
    this.timeline.moveTo(-1);
    this.scene.parts.clear();
  }

  private end(): void {
    this.report.snapshotTaken(performance.now() - this.beganAt_ms);
    this.panelsAt_ms = 0;
  }

  private readonly tick = (now_ms: number): void => {
    requestAnimationFrame(this.tick);
    const start = performance.now();
    this.timeline.advance(Math.min(0.5, (now_ms - this.before_ms) / 1000));
    // Where drawing is slow every second moment is left to the rest of the machine.
    if (this.hasDrawn && now_ms - this.before_ms > SLOW_MS) this.restUntil_ms = now_ms + Math.min(500, now_ms - this.before_ms);
    this.before_ms = now_ms;
    const drew = !this.store.isLoading && now_ms >= this.restUntil_ms && this.draw(now_ms, (now_ms - this.drawnAt_ms) / 1000);
    this.hasDrawn = drew;
    if (now_ms - this.panelsAt_ms > PANELS_EVERY_MS) this.updatePanels(now_ms);
    this.report.frameDone(performance.now() - start, drew);
  };

  private draw(now_ms: number, dt_s: number): boolean {
    this.firstLook();
    const isLost = this.timeline.cursor < 0 && this.status?.state === "lost" && this.status.phase === "running";
    this.drawnAt_ms = now_ms;
    const drew = this.scene.update(now_ms, Math.min(0.25, dt_s), this.timeline.shown, isLost);
    if (drew) this.axes.draw();
    return drew;
  }

  /** Chooses the view once there is something to see: a live camera is followed, a map shown as a whole. */
  private firstLook(): void {
    if (this.isFitted || this.store.keyframes.count === 0) return;
    this.isFitted = true;
    this.scene.measure();
    if (this.isUserView) return;
    const isMoving = this.status?.phase === "running" || this.status?.phase === "paused" || this.status?.phase === "starting";
    this.scene.update(this.before_ms, 0, this.timeline.shown, false);
    this.setView(this.hello?.mode === "live" && isMoving ? "follow" : "orbit", false);
  }

  private updatePanels(now_ms: number): void {
    this.panelsAt_ms = now_ms;
    // The stage stays as it is where the window goes to another screen.
    if (this.density !== window.devicePixelRatio) this.resize();
    const { hello, status, scene } = this;
    const retryIn_s = (this.retryAt_ms - now_ms) / 1000;
    this.notice.show({ connection: this.connectionState, retryIn_s, hello, status, canDraw: scene.canDraw }, this.store);
    this.legend.update();
    this.places.update(now_ms);
    this.timeline.draw();
    this.measure.update();
    this.drawScale();
    this.viewChoice.set(scene.view.name);
  }

  /** A length of the ground's grid, by the first part of the map. */
  private drawScale(): void {
    const { ground, unitsPerPixel: perPixel, canDraw } = this.scene;
    const factor = this.measure.factorOf(this.store.rootOf(0));
    byId("scale").hidden = this.store.keyframes.count === 0 || !canDraw;
    const length = ground.spacing * (ground.spacing / perPixel < 24 ? 10 : 1);
    byId("scale").style.setProperty("--length", `${Math.min(400, length / perPixel).toFixed(0)}px`);
    const shown = factor * length;
    const text = factor !== 1 ? shown.toPrecision(3) : String(shown >= 1 ? shown : shown.toPrecision(1));
    const unit = this.measure.unitOf(this.store.rootOf(0));
    setText(byId("scale"), `${text} ${text === "1" ? unit.replace(/s$/, "") : unit}`);
  }

  private resize(): void {
    const stage = byId("stage");
    this.density = window.devicePixelRatio;
    this.scene.resize(stage.clientWidth, stage.clientHeight);
  }

  private setView(name: ViewName, isUser: boolean): void {
    this.isUserView ||= isUser;
    this.scene.setView(name);
    this.viewChoice.set(this.scene.view.name);
    this.panelsAt_ms = 0;
  }

  private goToPart(part: number): void {
    this.isUserView = true;
    this.scene.goToPart(part);
  }

  private setTheme(theme: string): void {
    document.documentElement.dataset["theme"] = theme;
    this.scene.setPalette();
    this.timeline.draw(true);
  }

  private setUpButtons(): void {
    setIcon(byId("fit"), "fit");
    setIcon(byId("screenshot"), "camera");
    setIcon(byId("theme"), "theme");
    byId("fit").addEventListener("click", () => this.setView(this.scene.view.name === "top" ? "top" : "orbit", true));
    byId("screenshot").addEventListener("click", () => void this.saveScreenshot());
    byId("theme").addEventListener("click", () => this.toggleTheme());
    const help = byId<HTMLDialogElement>("help-panel");
    const toggleHelp = () => (help.open ? help.close() : help.showModal());
    byId("help").addEventListener("click", toggleHelp);
    help.addEventListener("click", () => help.close());
    const sheet = byId("open-sheet");
    const setSheet = (isOpen: boolean) => {
      byId("app").toggleAttribute("data-sheet", isOpen);
      sheet.setAttribute("aria-expanded", String(isOpen));
      setText(sheet, isOpen ? "Close" : "Legend");
    };
    sheet.addEventListener("click", () => setSheet(!byId("app").hasAttribute("data-sheet")));
    byId("stage").addEventListener("pointerdown", () => setSheet(false));
    const keys: Record<string, () => void> = {
      f: () => byId("fit").click(), s: () => void this.saveScreenshot(), d: () => this.toggleTheme(),
      " ": () => this.timeline.togglePlay(), "1": () => this.setView("follow", true), "2": () => this.setView("orbit", true),
      "3": () => this.setView("top", true), "?": toggleHelp, m: () => this.measure.toggle(), Escape: () => this.closePanels(),
    };
    addEventListener("keydown", (event) => {
      const isPress = event.key === " " && event.target instanceof HTMLButtonElement;
      const isText = event.target instanceof HTMLInputElement && event.key !== "Escape";
      const isForHelp = help.open && event.key !== "?";
      if (isPress || isText || isForHelp || event.ctrlKey || event.metaKey || event.altKey) return;
      const act = keys[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    });
  }

  private toggleTheme(): void {
    const theme = document.documentElement.dataset["theme"] === "dark" ? "light" : "dark";
    localStorage.setItem("theme", theme);
    this.setTheme(theme);
  }

  private setUpPicking(): void {
    const canvas = byId("scene");
    let down = { x: 0, y: 0 };
    canvas.addEventListener("pointerdown", (event) => (down = { x: event.offsetX, y: event.offsetY }));
    canvas.addEventListener("pointerup", (event) => {
      if (event.button !== 0 || Math.hypot(event.offsetX - down.x, event.offsetY - down.y) > 5) return;
      const picked = this.scene.pickAt(event.offsetX, event.offsetY);
      if (this.measure.isOn) this.measure.take(picked);
      else void this.inspector.select(picked);
    });
  }

  private closePanels(): void {
    this.measure.toggle(false);
    void this.inspector.select(null);
  }

  private async saveScreenshot(): Promise<void> {
    const blob = await this.scene.screenshot();
    if (!blob) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `waymark-${new Date().toISOString().slice(0, 19).replaceAll(":", "-")}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
}
