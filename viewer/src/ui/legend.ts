// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Colouring } from "../scene/landmark_layer";
import { LAYERS, type LayerName, type Scene } from "../scene/scene";
import { byId, Choice, grouped, make, setText } from "./dom";
import type { Measure } from "./measure";

const COLOURING_WORDS: [Colouring, string][] = [
  ["image", "Image"], ["height", "Height"], ["age", "Age"], ["observations", "Views"], ["part", "Part"],
];
const LAYER_LOOKS: Record<LayerName, { word: string; key: string; weight: string }> = {
  landmarks: { word: "Landmarks", key: "--ramp-2", weight: "dot" },
  keyframes: { word: "Keyframes", key: "--keyframe", weight: "2px" },
  markers: { word: "Markers", key: "--ink", weight: "dot" },
  covisibility: { word: "Covisibility", key: "--covisibility", weight: "1px" },
  tree: { word: "Tree", key: "--covisibility", weight: "2px" },
  loops: { word: "Loops", key: "--loop", weight: "2px" },
  trajectory: { word: "Trajectory", key: "--trail", weight: "4px" },
  grid: { word: "Grid", key: "--grid", weight: "1px" },
};

/** What is shown and what its colours mean: the switches are the legend. */
export class Legend {
  colouring: Colouring = "height";
  private readonly choice: Choice<Colouring>;
  private readonly markers: HTMLElement;

  constructor(private readonly scene: Scene, private readonly measure: Measure) {
    this.choice = new Choice(byId("colouring-choice"), COLOURING_WORDS, (value) => this.setColouring(value));
    for (const name of LAYERS) this.addSwitch(name);
    this.markers = byId("layer-list").querySelector<HTMLElement>("[data-layer=markers]")!;
    this.setColouring(this.colouring);
  }

  setColouring(colouring: Colouring): void {
    this.colouring = colouring;
    this.choice.set(colouring);
    this.scene.setColouring(colouring);
    this.update();
  }

  /** Shows what the ends of the ramp stand for. */
  update(): void {
    const { height, observations } = this.scene.landmarks.low_high;
    const ends: Partial<Record<Colouring, [string, string]>> = {
      height: [height.x, height.y].map((value) => this.measure.shown(0, [value], 1)) as [string, string],
      age: ["old", "new"],
      observations: [grouped(2 ** observations.x), grouped(2 ** observations.y)],
    };
    const shown = ends[this.colouring];
    byId("ramp").hidden = !shown;
    setText(byId("ramp-low"), shown?.[0] ?? "");
    setText(byId("ramp-high"), shown?.[1] ?? "");
    // Most maps have none.
    this.markers.hidden = this.scene.markers.count === 0;
  }

  private addSwitch(name: LayerName): void {
    const { word, key, weight } = LAYER_LOOKS[name];
    const mark = make("i");
    const button = make("button", { class: "switch", "data-layer": name, "data-key": weight }, mark, make("span", {}, word));
    button.style.setProperty("--key", `var(${key})`);
    if (weight !== "dot") button.style.setProperty("--weight", weight);
    const show = () => button.setAttribute("aria-pressed", String(this.scene.shown[name]));
    button.addEventListener("click", () => {
      this.scene.shown[name] = !this.scene.shown[name];
      this.scene.needsRender = true;
      show();
    });
    show();
    byId("layer-list").append(button);
  }
}
