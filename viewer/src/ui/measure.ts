// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { Vector3 } from "three";
import type { Connection } from "../connection";
import type { Picked } from "../scene/picking";
import type { Scene } from "../scene/scene";
import type { Store } from "../store/store";
import type { Hello } from "../text_messages";
import { byId, make, setIcon, setText } from "./dom";

/** A distance that somebody knows, of two places of one part of the map. */
interface Known {
  places: [Picked, Picked];
  metres: number;
  /** Metres per unit of the map. */
  factor: number;
}

/** Lengths between two places that are clicked, and what scale a known one gives the map. */
export class Measure {
  isOn = false;
  /** That an IMU put into metres. */
  metricPart: number | null = null;
  private readonly host = byId("measure-panel");
  private readonly button = byId("measure");
  private readonly length = make("strong", { role: "status" });
  private readonly hint = make("p", { class: "hint" });
  private readonly form: HTMLFormElement;
  private readonly input = make("input", { type: "text", inputmode: "decimal", "aria-label": "Its length in metres", placeholder: "2.5" });
  private readonly more = make("div");
  private readonly known = new Map<number, Known>();
  private places: Picked[] = [];
  private hello: Hello | null = null;

  constructor(private readonly scene: Scene, private readonly store: Store, private readonly connection: Connection) {
    setIcon(this.button, "measure");
    const close = make("button", { class: "icon", "aria-label": "Close", click: () => this.toggle(false) });
    setIcon(close, "close");
    const submit = make("button", { type: "submit" }, "Set");
    this.form = make("form", { submit: (event) => this.setKnown(event) }, make("label", {}, "It is ", this.input, " m"), submit);
    this.host.append(make("header", {}, this.length, close), this.hint, this.form, this.more);
    this.button.addEventListener("click", () => this.toggle());
  }

  setHello(hello: Hello): void {
    this.hello = hello;
  }

  /** Forgets all: another map comes. */
  clear(): void {
    this.places = [];
    this.known.clear();
    this.more.replaceChildren();
    this.update();
  }

  toggle(isOn = !this.isOn): void {
    this.isOn = isOn;
    this.host.hidden = !isOn;
    this.button.setAttribute("aria-pressed", String(isOn));
    if (!isOn) this.places = [];
    this.more.replaceChildren();
    this.update();
  }

  /** A place was clicked: the first, the second, or the first of others. */
  take(picked: Picked | null): void {
    if (!picked) return;
    this.places = this.places.length === 1 ? [...this.places, picked] : [picked];
    this.more.replaceChildren();
    this.input.value = "";
    this.update();
  }

  /** What is measured, in metres or units of the map; null as long as there are not two places of one part. */
  get measured(): { value: number; unit: string } | null {
    const part = this.part();
    const length = part === null ? null : this.units();
    return part === null || length === null ? null : { value: length * this.factorOf(part), unit: this.unitOf(part) };
  }

  /** Of a part of the map: that of lengths as they are shown. */
  unitOf(part: number): string {
    return this.isMetric(part) || this.known.has(part) ? "m" : "map units";
  }

  /** Shown lengths by those of the map. */
  factorOf(part: number): number {
    return this.known.get(part)?.factor ?? 1;
  }

  /** Of a sub-map: a length, or coordinates, as shown, with its unit. */
  shown(submap: number, lengths: readonly number[], digits: number, between = "  "): string {
    const part = this.store.rootOf(submap);
    return `${lengths.map((length) => (length * this.factorOf(part)).toFixed(digits)).join(between)} ${this.unitOf(part)}`;
  }

  /** Follows the map as it moves. */
  update(): void {
    for (const known of this.known.values()) {
      const length = this.distance(known.places);
      if (length) known.factor = known.metres / length;
    }
    if (!this.isOn) return this.scene.showMeasured([]);
    const found = this.places.map((place) => this.placeOf(place)).filter((place) => place !== null);
    this.scene.showMeasured(found);
    const part = this.part();
    const { measured } = this;
    setText(this.length, measured ? `${digits(measured.value)} ${measured.unit}` : "Measure");
    const isFree = part !== null && measured !== null && !this.isMetric(part);
    this.form.hidden = !isFree;
    setText(this.hint, this.advice(part, isFree));
  }

  private advice(part: number | null, isFree: boolean): string {
    if (this.places.length === 0) return "Click two places: landmarks or keyframes.";
    if (this.places.length === 1) return "And the other end.";
    if (part === null) return "The two are of parts of the map that are not joined: there is no distance.";
    const factor = this.known.get(part)?.factor;
    if (isFree && factor) return `A unit of this part of the map is ${digits(factor)} m.`;
    return isFree ? "The scale of this part of the map is free. Where you know this length, it is the scale." : "";
  }

  private setKnown(event: Event): void {
    event.preventDefault();
    const metres = Number(this.input.value.replace(",", "."));
    const part = this.part();
    const length = this.units();
    if (part === null || !length || !(metres > 0 && metres <= 1e6)) {
      this.more.replaceChildren(make("p", { class: "hint" }, "Expected a number of metres above 0."));
      return;
    }
    const places: [Picked, Picked] = [this.places[0]!, this.places[1]!];
    this.known.set(part, { places, metres, factor: metres / length });
    this.update();
    this.offer(places, metres);
  }

  /** How the map itself comes to have that scale. */
  private offer(places: [Picked, Picked], metres: number): void {
    if (this.hello?.controls.includes("scale")) {
      const button = make("button", { "data-control": "scale", click: () => void this.write(places, metres) }, "Write the scaled map");
      this.more.replaceChildren(button);
      return;
    }
    const isSaved = this.hello?.mode === "map";
    const [a, b] = places.map(({ kind, id }) => (kind === "landmark" ? `L${id}` : String(id)));
    const map = isSaved ? this.hello!.input : "MAP.wmap";
    const command = make("code", {}, `waymark map align ${map} --distance ${a} ${b} ${metres} -o scaled.wmap`);
    const words = isSaved ? "Shown so here only. To scale the map itself:" : "Shown so here only. To scale the map once it is saved:";
    this.more.replaceChildren(make("p", { class: "hint" }, words), command);
  }

  private async write(places: [Picked, Picked], metres: number): Promise<void> {
    const [a, b] = places.map(({ kind, id }) => ({ [kind]: id }));
    const say = (text: string) => this.more.replaceChildren(make("p", { class: "hint", role: "status" }, text));
    say("Writing…");
    const answer = await this.connection.request("scale", { a, b, metres });
    if (answer?.type !== "reply") say("Not written: the connection was lost");
    else say(answer.ok ? `Written to ${answer.path ?? "the file"}` : `Not written: ${answer.error}`);
  }

  /** The part that both places belong to, or null. */
  private part(): number | null {
    if (this.places.length < 2) return null;
    const [a, b] = this.places.map((place) => this.partOf(place));
    return a === undefined || a === -1 || a !== b ? null : a;
  }

  private partOf({ kind, id }: Picked): number {
    const table = kind === "keyframe" ? this.store.keyframes : this.store.landmarks;
    const slot = table.slots.find(id);
    return slot < 0 ? -1 : this.store.rootOf(table.facts[2 * slot + 1]!);
  }

  private isMetric(part: number): boolean {
    return this.store.submaps?.is_metric[part] !== 0 || part === this.metricPart;
  }

  private units(): number | null {
    return this.places.length < 2 ? null : this.distance([this.places[0]!, this.places[1]!]);
  }

  private distance([a, b]: [Picked, Picked]): number | null {
    const [from, to] = [this.placeOf(a), this.placeOf(b)];
    return from && to ? from.distanceTo(to) : null;
  }

  private placeOf(picked: Picked): Vector3 | null {
    const place = new Vector3();
    return this.scene.placeOf(picked, place) ? place : null;
  }
}

/** Three digits, or centimetres of what is longer. */
function digits(value: number): string {
  return value >= 10 ? value.toFixed(2) : value.toPrecision(3);
}
