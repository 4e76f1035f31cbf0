// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Connection } from "../connection";
import type { Picked } from "../scene/picking";
import type { Scene } from "../scene/scene";
import type { KeyframeData, LandmarkData } from "../text_messages";
import { byId, clock, countOf, grouped, make, setIcon } from "./dom";
import { KeyframePicture } from "./keyframe_picture";
import type { Measure } from "./measure";
import type { Store } from "../store/store";

const MOST_ROWS = 60;

/** All about the keyframe or landmark that was clicked. */
export class Inspector {
  selected: Picked | null = null;
  /** Whether the program has images of keyframes. */
  hasImages = false;
  private readonly host = byId("inspector");

  constructor(
    private readonly scene: Scene, private readonly store: Store, private readonly connection: Connection, private readonly measure: Measure,
  ) {}

  async select(picked: Picked | null, goThere = false): Promise<void> {
    this.selected = picked;
    this.scene.select(picked);
    this.host.hidden = picked === null;
    if (!picked) return;
    if (goThere) this.scene.goTo(picked);
    this.host.removeAttribute("data-large");
    this.fill(picked, make("p", {}, "…"));
    const picture = picked.kind === "keyframe" && this.hasImages ? this.pictureOf(picked) : null;
    const answer = await this.connection.request(picked.kind, { id: picked.id });
    if (this.selected !== picked) return;
    if (answer?.type === "keyframe") {
      this.scene.select(picked, answer.landmarks);
      this.fill(picked, ...(picture ? [picture.element] : []), ...this.keyframe(answer));
    } else if (answer?.type === "landmark") {
      this.scene.select(picked, answer.observations.map((each) => each.keyframe));
      this.fill(picked, ...this.landmark(answer));
    } else {
      this.fill(picked, make("p", {}, answer?.type === "reply" ? (answer.error ?? "") : "No connection"));
    }
  }

  private pictureOf(picked: Picked): KeyframePicture {
    const picture = new KeyframePicture();
    void this.connection.request("image", { id: picked.id }).then((answer) => {
      if (this.selected !== picked) return;
      if (answer?.type === "image") void picture.show(answer);
      else picture.say(answer?.type === "reply" ? `No image: ${answer.error ?? ""}` : "No connection");
    });
    return picture;
  }

  private fill(picked: Picked, ...content: Node[]): void {
    const close = make("button", { class: "icon", "aria-label": "Close", click: () => void this.select(null) });
    setIcon(close, "close");
    const title = make("h2", {}, `${picked.kind === "keyframe" ? "Keyframe" : "Landmark"} ${picked.id}`);
    this.host.replaceChildren(make("header", {}, title, close), ...content);
  }

  private keyframe(data: KeyframeData): Node[] {
    const slot = this.store.keyframes.slots.find(data.id);
    const facts = rows([
      ["Time", slot >= 0 ? clock(this.store.keyframes.time_s[slot]!) : ""],
      ["Time stamp, ns", data.timestamp_ns],
      ["Frame", grouped(data.frame)],
      ["Part", String(data.submap)],
      ["Camera", data.camera],
      ["Features", grouped(data.features)],
      ["Landmarks seen", grouped(data.landmarks.length)],
      ["Position", this.measure.shown(data.submap, data.position, 2)],
    ]);
    const links = data.covisible.slice(0, MOST_ROWS).map(([id, shared]) => make("span", {}, this.link(id), make("small", {}, ` ${shared}`)));
    if (data.parent !== null && data.parent !== 0xffffffff) {
      const parent = make("div", { class: "links" }, this.link(data.parent));
      return [facts, make("h3", {}, "Parent"), parent, make("h3", {}, "Shares landmarks with"), make("div", { class: "links" }, ...links)];
    }
    return [facts, make("h3", {}, "Shares landmarks with"), make("div", { class: "links" }, ...links)];
  }

  private landmark(data: LandmarkData): Node[] {
    const found = data.num_visible > 0 ? `${data.num_found} of ${countOf(data.num_visible, "time")}` : "";
    const facts = rows([
      ["Seen by", countOf(data.observations.length, "keyframe")],
      ["Found in view", found],
      ["Made from", ""],
      ["Part", String(data.submap)],
      ["Position", this.measure.shown(data.submap, data.position, 2)],
    ]);
    facts.querySelectorAll("dd")[2]!.replaceChildren(this.link(data.reference));
    const head = make("tr", {}, ...["Keyframe", "Pixel", "Error, px"].map((word) => make("th", {}, word)));
    const lines = data.observations.slice(0, MOST_ROWS).map((each) => {
      const pixel = `${each.pixel[0].toFixed(1)}, ${each.pixel[1].toFixed(1)}`;
      return make("tr", {}, make("td", {}, this.link(each.keyframe)), make("td", {}, pixel), make("td", {}, each.error_px?.toFixed(2) ?? "–"));
    });
    return [facts, make("h3", {}, "Observations"), make("table", {}, head, ...lines)];
  }

  private link(id: number): HTMLElement {
    return make("button", { class: "link", click: () => void this.select({ kind: "keyframe", id }, true) }, String(id));
  }
}

function rows(items: [string, string][]): HTMLElement {
  return make("dl", {}, ...items.flatMap(([name, value]) => [make("dt", {}, name), make("dd", { "data-small": value.length > 16 }, value)]));
}
