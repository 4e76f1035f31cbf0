// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Store } from "../store/store";
import type { Hello } from "../text_messages";
import { byId, clock, make, setIcon, setText } from "./dom";
import type { Measure } from "./measure";
import { REASON_WORDS, STATE_COLOURS, STATE_WORDS } from "./words";

const SPEEDS = [1, 4, 16];
const BASE_PX = 16;
/** Growing, the profile is drawn anew at most so often. */
const REDRAW_MS = 450;
/** Of states that share a column the one with most to say is shown. */
const WEIGHT: Record<string, number> = { tracked: 1, filled: 2, initializing: 3, unreadable: 4, dropped: 4, lost: 5 };

/**
 * The session as a profile, like that of a hike: time to the right; upward the time that tracking took, or in a saved map the height
 * of the way. The colour is the state. Where one points is a moment to look at; playing walks through them.
 */
export class Timeline {
  /** Frame that is looked at; -1: the newest. */
  cursor = -1;
  isPlaying = false;
  private readonly canvas = byId<HTMLCanvasElement>("profile");
  private readonly context = this.canvas.getContext("2d")!;
  private readonly play = byId("play");
  private readonly now = make("button", { class: "quiet", hidden: true, click: () => this.moveTo(-1) }, "Back to now");
  private readonly time = make("span");
  private states: string[] = [];
  private reasons: string[] = [];
  private speed = 0;
  private playTime_s = 0;
  private drawnView = "";
  private drawnVersion = -1;
  private drawnAt_ms = 0;
  private values = new Float32Array(0);
  private worst = new Uint8Array(0);
  private isLive = true;

  constructor(private readonly store: Store, private readonly measure: Measure, private readonly whenMoved: () => void) {
    byId("clock").append(this.time, this.now);
    setIcon(this.play, "play");
    this.play.addEventListener("click", () => this.togglePlay());
    byId("speed").addEventListener("click", () => {
      this.speed = (this.speed + 1) % SPEEDS.length;
      setText(byId("speed"), `${SPEEDS[this.speed]}×`);
    });
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.moveTo(this.indexAt(event.offsetX));
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.moveTo(this.indexAt(event.offsetX));
      this.hint(event.offsetX);
    });
    this.canvas.addEventListener("pointerleave", () => (byId("hint").hidden = true));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  setHello(hello: Hello): void {
    this.states = hello.states;
    this.reasons = hello.reasons;
    this.isLive = hello.mode === "live";
  }

  /** Index of the frame to show. */
  get shown(): number {
    const last = this.store.trajectory.count - 1;
    return this.cursor < 0 ? last : Math.min(this.cursor, last);
  }

  togglePlay(): void {
    const { trajectory } = this.store;
    if (trajectory.count === 0) return;
    this.isPlaying = !this.isPlaying;
    if (this.isPlaying && this.shown >= trajectory.count - 1) this.cursor = 0;
    this.playTime_s = trajectory.time_s[Math.max(0, this.shown)]!;
    setIcon(this.play, this.isPlaying ? "pause" : "play");
    this.whenMoved();
  }

  /** One step of playing. */
  advance(dt_s: number): void {
    if (!this.isPlaying) return;
    const { trajectory } = this.store;
    this.playTime_s += dt_s * SPEEDS[this.speed]!;
    const index = trajectory.indexAtTime(this.playTime_s);
    if (index >= trajectory.count - 1) this.moveTo(-1);
    else if (index !== this.cursor) {
      this.cursor = index;
      this.whenMoved();
    }
  }

  moveTo(index: number): void {
    this.cursor = index >= this.store.trajectory.count - 1 ? -1 : index;
    if (this.isPlaying) setIcon(this.play, "play");
    this.isPlaying = false;
    this.whenMoved();
  }

  /** Draws where something changed. */
  draw(force = false): void {
    const { canvas, context, store } = this;
    const ratio = Math.min(2, window.devicePixelRatio);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    const view = `${this.cursor} ${width} ${height} ${this.measure.factorOf(0)}`;
    const isSame = view === this.drawnView && store.trajectory.version === this.drawnVersion;
    const isEarly = view === this.drawnView && performance.now() - this.drawnAt_ms < REDRAW_MS;
    if ((isSame || isEarly) && !force) return;
    this.drawnView = view;
    this.drawnVersion = store.trajectory.version;
    this.drawnAt_ms = performance.now();
    canvas.width = width;
    canvas.height = height;
    context.scale(ratio, ratio);
    const { trajectory } = store;
    const at = this.shown;
    const time = at >= 0 ? trajectory.time_s[at]! : 0;
    setText(this.time, trajectory.count > 0 ? `${clock(time)} of ${clock(this.duration)}` : "");
    this.now.hidden = !this.isLive || this.cursor < 0;
    canvas.setAttribute("aria-valuenow", time.toFixed(1));
    canvas.setAttribute("aria-valuemax", this.duration.toFixed(1));
    canvas.setAttribute("aria-valuetext", clock(time));
    if (trajectory.count === 0) return;
    this.bin(Math.max(1, Math.floor(canvas.clientWidth)));
    this.drawProfile(canvas.clientHeight - BASE_PX);
    this.drawAxis(canvas.clientWidth, canvas.clientHeight);
    this.drawCursor(canvas.clientWidth * (time / this.duration), canvas.clientHeight);
  }

  private get duration(): number {
    const { trajectory } = this.store;
    return Math.max(1e-3, trajectory.count > 0 ? trajectory.time_s[trajectory.count - 1]! : 0);
  }

  /** For each column the largest value and the weightiest state. */
  private bin(columns: number): void {
    const { trajectory } = this.store;
    if (this.values.length !== columns) {
      this.values = new Float32Array(columns);
      this.worst = new Uint8Array(columns);
    }
    this.values.fill(-Infinity);
    this.worst.fill(255);
    const perSecond = (columns - 1) / this.duration;
    const weights = this.states.map((state) => WEIGHT[state] ?? 0);
    for (let i = 0; i < trajectory.count; ++i) {
      const column = Math.min(columns - 1, Math.max(0, Math.round(trajectory.time_s[i]! * perSecond)));
      const value = this.isLive ? trajectory.tracking_ms[i]! : -trajectory.position[3 * i + 1]!;
      if (value > this.values[column]! && (this.isLive || trajectory.hasPose(i))) this.values[column] = value;
      const before = this.worst[column]!;
      const state = trajectory.state[i]!;
      if (before === 255 || weights[state]! > weights[before]!) this.worst[column] = state;
    }
  }

  private drawProfile(height: number): void {
    const { context, values, worst } = this;
    const style = getComputedStyle(document.documentElement);
    const colours = this.states.map((state) => style.getPropertyValue(STATE_COLOURS[state] ?? "--muted"));
    let low = Infinity;
    for (const value of values) if (value > -Infinity && value < low) low = value;
    const top = quantile(values, 0.99);
    const floor = this.isLive ? 0 : low - 0.15 * (top - low);
    const unit = (height - 18) / Math.max(1e-6, top - floor);
    const mostBetween = this.isLive ? Math.max(2, (3 * values.length) / this.store.trajectory.count) : Infinity;
    let last = -1;
    let next = 0;
    for (let column = 0; column < values.length; ++column) {
      if (worst[column] !== 255) last = column;
      // Between frames the profile goes on, but not across gaps; the way of a map, which has keyframes only, goes straight on.
      if (last < 0 || column - last > mostBetween) continue;
      while (next < values.length && (next <= last || worst[next] === 255)) ++next;
      const share = this.isLive || next === values.length ? 0 : (column - last) / (next - last);
      const value = values[last]! + (share > 0 ? share * (values[next]! - values[last]!) : 0);
      const tall = value > -Infinity ? Math.max(1, Math.min(height, (value - floor) * unit)) : 0;
      context.fillStyle = colours[worst[last]!] ?? "gray";
      context.globalAlpha = 0.3;
      context.fillRect(column, height - tall, 1, tall);
      context.globalAlpha = 1;
      context.fillRect(column, height - tall, 1, 1.5);
      context.fillRect(column, height, 1, 3);
    }
    context.fillStyle = style.getPropertyValue("--muted");
    context.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    context.fillText(this.isLive ? `Tracking, up to ${top.toFixed(0)} ms` : `Height of the way, ${this.measure.shown(0, [low, top], 1, " to ")}`, 0, 10);
  }

  private drawAxis(width: number, height: number): void {
    const { context } = this;
    const wanted = this.duration / Math.max(2, width / 110);
    const step = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600, 7200].find((each) => each >= wanted) ?? 14400;
    context.textAlign = "center";
    for (let t = step; t < this.duration * 0.985; t += step) {
      const x = (width * t) / this.duration;
      context.fillRect(x, height - BASE_PX + 3, 1, 3);
      context.fillText(clock(t, false), x, height - 1);
    }
    context.textAlign = "start";
  }

  private drawCursor(x: number, height: number): void {
    const { context } = this;
    const style = getComputedStyle(document.documentElement);
    const left = Math.min(Math.max(1, x), this.canvas.clientWidth - 2);
    context.fillStyle = style.getPropertyValue("--trail");
    context.fillRect(left - 0.75, 0, 1.5, height - BASE_PX + 3);
    context.fillRect(left - 3, 0, 6, 10);
    context.fillStyle = style.getPropertyValue("--ink");
    context.fillRect(left - 3, 0, 6, 3);
    context.fillRect(left - 3, 7, 6, 3);
  }

  private indexAt(x: number): number {
    const time = (Math.max(0, x) / Math.max(1, this.canvas.clientWidth)) * this.duration;
    return this.store.trajectory.indexAtTime(time);
  }

  private hint(x: number): void {
    const { trajectory } = this.store;
    const host = byId("hint");
    host.hidden = trajectory.count === 0;
    if (host.hidden) return;
    const i = this.indexAt(x);
    const state = this.states[trajectory.state[i]!] ?? "";
    const reason = REASON_WORDS[this.reasons[trajectory.reason[i]!] ?? ""] ?? "";
    const parts = [clock(trajectory.time_s[i]!), `frame ${trajectory.frame[i]}`];
    if (this.isLive) parts.push((STATE_WORDS[state] ?? state) + (reason ? `: ${reason}` : ""));
    if (trajectory.tracking_ms[i]! > 0) parts.push(`${trajectory.tracking_ms[i]!.toFixed(1)} ms`);
    setText(host, parts.join(" · "));
    const half = host.offsetWidth / 2 + 4;
    const centre = this.canvas.offsetLeft + x;
    host.style.left = `${Math.max(half, Math.min(byId("timeline").clientWidth - half, centre))}px`;
  }

  private key(event: KeyboardEvent): void {
    const steps: Record<string, number> = { ArrowLeft: -1, ArrowRight: 1, PageUp: -50, PageDown: 50 };
    const step = steps[event.key];
    if (step === undefined) return;
    event.preventDefault();
    this.moveTo(Math.max(0, this.shown + step));
  }
}

function quantile(values: Float32Array, share: number): number {
  const finite = values.filter((value) => value > -Infinity).sort();
  return finite.length > 0 ? finite[Math.floor(share * (finite.length - 1))]! : 1;
}
