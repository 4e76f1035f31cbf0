// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { App } from "./app";
import type { Status } from "./text_messages";

const NUM_TIMES = 600;

/** What the page says of itself as `window.waymark`, for tests and measurements. */
export interface Report {
  readonly connection: string;
  readonly session: Status | null;
  readonly generation: number;
  readonly isLoading: boolean;
  /** Binary messages taken in since the page was opened. */
  readonly sequence: number;
  readonly landmarks: number;
  readonly keyframes: number;
  readonly trajectory: number;
  readonly frames: number;
  readonly covisibilityEdges: number;
  readonly loopEdges: number;
  readonly view: string;
  readonly colouring: string;
  readonly selected: { kind: string; id: number } | null;
  readonly markers: number;
  readonly edgePoints: number;
  /** Between the two places that were clicked, if two were. */
  readonly measured: { value: number; unit: string } | null;
  /** How often the counts of a status were those of the page when it came, and how often not. */
  readonly agreement: { equal: number; different: number };
  readonly performance: Performance;
  /** Forgets the times measured so far. */
  resetPerformance(): void;
}

interface Performance {
  /** Script time per frame that was drawn, with the messages that were taken in before it. */
  readonly script_ms: { median: number; p95: number; max: number; count: number };
  readonly drawCalls: number;
  /** From `begin` to `end` of the last snapshot. */
  readonly snapshot_ms: number;
}

export function publish(app: App): Recorder {
  const recorder = new Recorder();
  const { store } = app;
  const report: Report = {
    get connection() { return app.connectionState; },
    get session() { return app.status; },
    get generation() { return store.generation; },
    get isLoading() { return store.isLoading; },
    get sequence() { return recorder.sequence; },
    get landmarks() { return store.landmarks.count; },
    get keyframes() { return store.keyframes.count; },
    get trajectory() { return store.trajectory.numPoses; },
    get frames() { return store.trajectory.count; },
    get covisibilityEdges() { return [...store.keyframes.older.values()].reduce((sum, list) => sum + list.length, 0); },
    get loopEdges() { return store.keyframes.loops.length / 2; },
    get view() { return app.scene.view.name; },
    get colouring() { return app.colouring; },
    get selected() { return app.inspector.selected; },
    get markers() { return store.markers?.id.length ?? 0; },
    get edgePoints() { return store.landmarks.numEdges; },
    get measured() { return app.measure.measured; },
    get agreement() { return { ...recorder.agreement }; },
    get performance() { return { script_ms: recorder.times(), drawCalls: app.scene.drawCalls, snapshot_ms: recorder.snapshot_ms }; },
    resetPerformance: () => recorder.reset(),
  };
  recorder.isComparable = () => store.generation > 0 && !store.isLoading;
  recorder.compare = (status) => status.landmarks === store.landmarks.count && status.keyframes === store.keyframes.count;
  (window as unknown as { waymark: Report }).waymark = report;
  return recorder;
}

/** Counts and times, without allocation. */
export class Recorder {
  sequence = 0;
  snapshot_ms = 0;
  readonly agreement = { equal: 0, different: 0 };
  compare: (status: Status) => boolean = () => true;
  /** False before the first snapshot is complete. */
  isComparable: () => boolean = () => true;
  private readonly script_ms = new Float32Array(NUM_TIMES);
  private count = 0;
  private pending_ms = 0;

  messageTaken(time_ms: number): void {
    ++this.sequence;
    this.pending_ms += time_ms;
  }

  snapshotTaken(time_ms: number): void {
    this.snapshot_ms = time_ms;
  }

  statusTaken(status: Status): void {
    if (!this.isComparable()) return;
    if (this.compare(status)) ++this.agreement.equal;
    else ++this.agreement.different;
  }

  frameDone(time_ms: number, drew: boolean): void {
    if (drew) this.script_ms[this.count++ % NUM_TIMES] = time_ms + this.pending_ms;
    this.pending_ms = 0;
  }

  reset(): void {
    this.count = 0;
  }

  times(): Performance["script_ms"] {
    const sorted = this.script_ms.slice(0, Math.min(this.count, NUM_TIMES)).sort();
    const at = (share: number) => sorted[Math.floor(share * (sorted.length - 1))] ?? 0;
    return { median: at(0.5), p95: at(0.95), max: at(1), count: sorted.length };
  }
}
