// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { KeyframeImage } from "../protocol";
import { countOf, make, setText } from "./dom";
import { drawDots, FEATURE_LOOKS } from "./features";

/** Beyond this a canvas costs more than it shows. */
const MOST_PX = 1600;

/** The image of a keyframe with its features: those that see a landmark, and free ones. A press makes it large, or small again. */
export class KeyframePicture {
  readonly element: HTMLElement;
  private readonly canvas = make("canvas");
  private readonly caption = make("figcaption", {}, "…");

  constructor() {
    const frame = make("button", { class: "picture", "aria-label": "Larger or smaller", click: () => this.toggle() }, this.canvas);
    this.element = make("figure", { class: "keyframe-image" }, frame, this.caption);
  }

  say(text: string): void {
    this.canvas.parentElement!.hidden = true;
    setText(this.caption, text);
  }

  async show(image: KeyframeImage): Promise<void> {
    const blob = new Blob([image.jpeg as Uint8Array<ArrayBuffer>], { type: "image/jpeg" });
    const picture = await createImageBitmap(blob).catch(() => null);
    if (!picture) return this.say("The image cannot be read");
    const scale = Math.min(1, MOST_PX / image.width_px);
    const { canvas } = this;
    canvas.width = Math.max(1, Math.round(scale * image.width_px));
    canvas.height = Math.max(1, Math.round(scale * image.height_px));
    const context = canvas.getContext("2d")!;
    context.drawImage(picture, 0, 0, canvas.width, canvas.height);
    picture.close();
    const { seen, free } = FEATURE_LOOKS;
    const size = canvas.width / 400;
    const numSeen = drawDots(context, image, (state) => (state & 1) === 1, scale, seen.colour, seen.radius * size);
    const numFree = drawDots(context, image, (state) => (state & 1) === 0, scale, free.colour, free.radius * size);
    const numOnEdges = image.state.reduce((sum, state) => sum + (state >> 1), 0);
    const onEdges = numOnEdges > 0 ? `; on edges: ${numOnEdges} of all` : "";
    setText(this.caption, `${countOf(numSeen, "feature")} with a landmark, ${numFree} free${onEdges}`);
    this.element.dataset["shown"] = String(image.keyframe);
  }

  private toggle(): void {
    this.element.closest("aside")?.toggleAttribute("data-large");
  }
}
