// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Store } from "../store/store";
import { byId, clock, countOf, make, setText } from "./dom";

const UPDATE_EVERY_MS = 1500;
/** Beyond this only every so many keyframes are listed. */
const MOST_LISTED = 1000;

/** One part of the map in the list. */
interface Entry {
  readonly element: HTMLDetailsElement;
  readonly name: HTMLElement;
  readonly list: HTMLElement;
  /** Places of its keyframes in the table, by age. */
  slots: number[];
}

/** Whom the list sends somewhere. */
export interface Guide {
  goToPart(part: number): void;
  goToKeyframe(id: number): void;
}

/** The parts of the map and their keyframes, to go to. */
export class Places {
  private readonly host = byId("places-list");
  private readonly entries = new Map<number, Entry>();
  private updatedAt_ms = -Infinity;
  private version = -1;

  constructor(private readonly store: Store, private readonly guide: Guide) {}

  /** Follows the map as it grows. */
  update(now_ms: number): void {
    if (this.version === this.store.version || now_ms - this.updatedAt_ms < UPDATE_EVERY_MS) return;
    this.version = this.store.version;
    this.updatedAt_ms = now_ms;
    const parts = this.slotsByPart();
    byId("places").hidden = parts.size === 0;
    for (const [part, entry] of this.entries) {
      if (parts.has(part)) continue;
      entry.element.remove();
      this.entries.delete(part);
    }
    for (const [part, slots] of parts) this.show(part, slots);
  }

  private slotsByPart(): Map<number, number[]> {
    const { keyframes } = this.store;
    const parts = new Map<number, number[]>();
    for (let slot = 0; slot < keyframes.slots.end; ++slot) {
      if (!keyframes.isAlive(slot)) continue;
      const part = this.store.rootOf(keyframes.facts[2 * slot + 1]!);
      const slots = parts.get(part) ?? [];
      if (slots.push(slot) === 1) parts.set(part, slots);
    }
    for (const slots of parts.values()) slots.sort((a, b) => keyframes.id[a]! - keyframes.id[b]!);
    return parts;
  }

  private show(part: number, slots: number[]): void {
    const entry = this.entries.get(part) ?? this.add(part);
    const isSame = String(entry.slots) === String(slots);
    entry.slots = slots;
    setText(entry.name, `Part ${part}: ${countOf(slots.length, "keyframe")}`);
    if (!isSame && entry.element.open) this.fill(part, entry);
  }

  private add(part: number): Entry {
    const name = make("summary");
    const list = make("div", { class: "links" });
    const element = make("details", { "data-part": String(part) }, name, list);
    const entry: Entry = { element, name, list, slots: [] };
    element.addEventListener("toggle", () => element.open && this.fill(part, entry));
    this.host.append(element);
    this.entries.set(part, entry);
    return entry;
  }

  private fill(part: number, { list, slots }: Entry): void {
    const { id, time_s } = this.store.keyframes;
    const step = Math.ceil(slots.length / MOST_LISTED);
    const link = (word: string, act: () => void) => make("button", { class: "link", click: act }, word);
    const keyframes = slots.filter((_, i) => i % step === 0).map((slot) => {
      const own = id[slot]!;
      return make("span", {}, link(String(own), () => this.guide.goToKeyframe(own)), make("small", {}, ` ${clock(time_s[slot]!)}`));
    });
    const more = step > 1 ? [make("small", {}, `one keyframe in ${step}:`)] : [];
    list.replaceChildren(link("Whole part", () => this.guide.goToPart(part)), ...more, ...keyframes);
  }
}
