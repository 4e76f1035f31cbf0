// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Hello, Status } from "../text_messages";
import { byId, countOf, grouped, make, sentence, setText } from "./dom";
import { isOver, PHASE_WORDS, REASON_WORDS, STAGE_WORDS, STATE_COLOURS, STATE_WORDS } from "./words";

const STAGE_COLOURS = ["--part-0", "--part-7", "--hairline", "--part-4", "--part-5", "--part-1", "--part-6", "--part-3"];

/** Name of the session, its state, figures and time per stage. */
export class SessionPanel {
  private readonly figures = new Map<string, HTMLElement>();
  private readonly bars: HTMLElement[] = [];
  private readonly times: HTMLElement[] = [];
  private isLive = true;

  setHello(hello: Hello): void {
    setText(byId("title"), hello.input || "Waymark");
    const kind = hello.mode === "map" ? "saved map" : [hello.setup, hello.timing].filter(Boolean).join(", ");
    setText(byId("subtitle"), `${kind} · ${hello.program}`);
    document.title = `${hello.input || "map"} · Waymark`;
    byId("app").dataset["mode"] = hello.mode;
    this.isLive = hello.mode === "live";
    this.makeFigures();
    this.makeStages(this.isLive ? hello.stages : []);
  }

  setStatus(status: Status): void {
    this.setState(status);
    const set = (name: string, text: string) => {
      const element = this.figures.get(name);
      if (element) setText(element, text);
    };
    set("Keyframes", grouped(status.keyframes));
    set("Landmarks", grouped(status.landmarks));
    set("Loops", grouped(status.loops));
    set("Parts", grouped(status.submaps));
    set("Frames", grouped(status.frames));
    set("Frames/s", status.frames_per_s.toFixed(1));
    set("Dropped", grouped(status.dropped + status.unreadable));
    set("Times lost", grouped(status.lost_count));
    this.setStages(status);
  }

  /** The program is gone; what it said last stays where it had said that all was done. */
  setGone(status: Status | null, hasMap: boolean): void {
    if (status && isOver(status)) {
      setText(byId("state-detail"), `${detailOf(status)}. The program has ended`);
      return;
    }
    setText(byId("state-name"), "No connection");
    setText(byId("state-detail"), hasMap ? "What is shown is the last that came" : "");
    byId("app").style.setProperty("--state", "var(--muted)");
  }

  private setState(status: Status): void {
    const isTracking = status.phase === "running" || status.phase === "paused";
    const isPaused = status.phase === "paused";
    const word = isTracking && !isPaused ? STATE_WORDS[status.state] : PHASE_WORDS[status.phase];
    setText(byId("state-name"), `${word ?? status.state}${isTracking && !status.is_mapping ? ", map kept as it is" : ""}`);
    const isLoading = status.phase === "starting" && !this.isLive;
    setText(byId("state-detail"), isLoading ? "Loading the map" : detailOf(status));
    const colour = isTracking && !isPaused ? STATE_COLOURS[status.state] : undefined;
    const settled = status.phase === "done" || status.phase === "map" ? "--keyframe" : "--starting";
    byId("app").style.setProperty("--state", `var(${colour ?? settled})`);
  }

  private makeFigures(): void {
    this.figures.clear();
    const list = byId("figures");
    list.replaceChildren();
    const names = ["Keyframes", "Landmarks", "Loops", "Parts"];
    if (this.isLive) names.push("Frames", "Frames/s", "Dropped", "Times lost");
    for (const name of names) {
      const value = make("dd", {}, "–");
      this.figures.set(name, value);
      list.append(make("div", {}, make("dt", {}, name), value));
    }
  }

  private makeStages(stages: string[]): void {
    byId("stages").hidden = stages.length === 0;
    this.bars.length = this.times.length = 0;
    const items = stages.map((stage, i) => {
      const key = make("i");
      const bar = make("i");
      key.style.background = bar.style.background = `var(${STAGE_COLOURS[i % STAGE_COLOURS.length]})`;
      const time = make("b", {}, "–");
      this.bars.push(bar);
      this.times.push(time);
      return make("li", {}, key, make("span", {}, STAGE_WORDS[stage] ?? stage), time);
    });
    byId("stages-bar").replaceChildren(...this.bars);
    byId("stages-list").replaceChildren(...items);
  }

  private setStages(status: Status): void {
    const total = status.stages_ms.reduce((sum, time) => sum + time, 0);
    // The bar is full at twice the median, so that slow frames show.
    const full = Math.max(total, 2 * status.tracking_ms_median, 1e-3);
    status.stages_ms.forEach((time, i) => {
      if (!this.bars[i]) return;
      this.bars[i].style.width = `${((100 * time) / full).toFixed(1)}%`;
      setText(this.times[i]!, time.toFixed(1));
    });
    setText(byId("stages-total"), `${status.tracking_ms.toFixed(1)} ms, median ${status.tracking_ms_median.toFixed(1)}`);
  }
}

function detailOf(status: Status): string {
  const { phase } = status;
  if (phase === "starting") return sentence(status.doing || "waiting for the first image");
  if (phase === "finishing") return "The last adjustment of the whole map";
  if (phase === "map") return status.submaps === 1 ? "One part" : `${status.submaps} parts`;
  if (phase === "done") return `${grouped(status.tracked)} of ${grouped(status.frames)} frames have a pose`;
  if (status.state === "tracked") return `${countOf(status.matches, "landmark")} found, ${grouped(status.inliers)} fit`;
  return sentence(REASON_WORDS[status.reason] ?? status.reason);
}
