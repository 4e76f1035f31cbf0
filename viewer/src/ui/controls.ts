// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Connection } from "../connection";
import type { Control, Hello, Status } from "../text_messages";
import { byId, make, setText } from "./dom";

const SURE_MS = 3000;
const NOTE_MS = 6000;

/** What one can do to the running session. */
export class Controls {
  private readonly host = byId("controls");
  private readonly note = make("span", { class: "wide", role: "status" });
  private buttons: Partial<Record<Control, HTMLButtonElement>> = {};
  private isPaused = false;
  private isMapping = true;
  private timer = 0;

  constructor(private readonly connection: Connection) {}

  setHello(hello: Hello): void {
    this.host.replaceChildren();
    this.buttons = {};
    const has = (control: Control) => hello.controls.includes(control);
    if (has("pause")) this.add("pause", "Pause", () => this.send(this.isPaused ? "resume" : "pause"));
    if (has("mapping")) this.add("mapping", "Stop mapping", () => this.send("mapping", { on: !this.isMapping }));
    if (has("save")) this.add("save", "Save", () => this.save());
    if (has("reset")) this.add("reset", "Start over", () => this.askFirst("reset", "Start over", "Forget the map?"));
    if (has("stop")) this.add("stop", "End", () => this.askFirst("stop", "End", "End the session?"));
    if (hello.controls.length > 0) this.host.append(this.note);
    setText(this.note, "");
  }

  setStatus(status: Status): void {
    this.isPaused = status.phase === "paused";
    this.isMapping = status.is_mapping;
    const isOver = status.phase === "finishing" || status.phase === "done";
    for (const [control, button] of Object.entries(this.buttons)) button.disabled = isOver && control !== "save";
    if (this.buttons.pause) setText(this.buttons.pause, this.isPaused ? "Resume" : "Pause");
    if (this.buttons.mapping) setText(this.buttons.mapping, this.isMapping ? "Stop mapping" : "Go on mapping");
  }

  togglePause(): boolean {
    if (!this.buttons.pause || this.buttons.pause.disabled) return false;
    this.buttons.pause.click();
    return true;
  }

  private add(control: Control, word: string, act: () => void): void {
    const button = make("button", { "data-control": control, click: act }, word);
    this.buttons[control] = button;
    this.host.append(button);
  }

  /** Asks on the button itself: it acts at the second press within three seconds. */
  private askFirst(control: Control, word: string, question: string): void {
    const button = this.buttons[control]!;
    const isSure = button.classList.contains("sure");
    const calm = () => {
      button.classList.remove("sure");
      setText(button, word);
    };
    if (isSure) {
      calm();
      this.send(control);
    } else {
      button.classList.add("sure");
      setText(button, question);
      setTimeout(calm, SURE_MS);
    }
  }

  private async send(control: Control, more: Record<string, unknown> = {}): Promise<void> {
    const answer = await this.connection.request(control, more);
    if (answer?.type === "reply" && !answer.ok) this.say(answer.error ?? "That did not work");
  }

  private async save(): Promise<void> {
    const { save } = this.buttons;
    save!.disabled = true;
    setText(this.note, "Saving…");
    const answer = await this.connection.request("save");
    save!.disabled = false;
    if (answer?.type === "reply") this.say(answer.ok ? `Saved to ${answer.path ?? "the file"}` : `Not saved: ${answer.error}`);
    else this.say("Not saved: the connection was lost");
  }

  private say(text: string): void {
    setText(this.note, text);
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => setText(this.note, ""), NOTE_MS);
  }
}
