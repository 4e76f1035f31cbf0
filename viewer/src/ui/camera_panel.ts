// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { Frame } from "../protocol";
import { byId, make, setText } from "./dom";
import { drawDots, FEATURE_LOOKS } from "./features";

/** The newest image with its features: those that see a landmark, and free ones. */
export class CameraPanel {
  private readonly host = byId("camera");
  private readonly canvas = byId<HTMLCanvasElement>("camera-image");
  private readonly context = this.canvas.getContext("2d")!;
  private readonly seen = make("b");
  private readonly free = make("b");
  private image: ImageBitmap | null = null;
  private isBusy = false;
  private next: Frame | null = null;

  constructor() {
    this.seen.style.setProperty("--dot", "var(--tracked)");
    this.free.style.setProperty("--dot", "var(--starting)");
    byId("camera-caption").append(this.seen, this.free);
  }

  /** Shows a frame. While one is decoded only the newest of those that come is kept. */
  async show(frame: Frame): Promise<void> {
    this.next = frame;
    if (this.isBusy) return;
    this.isBusy = true;
    while (this.next) {
      const newest: Frame = this.next;
      this.next = null;
      if (newest.jpeg.length > 0) {
        const blob = new Blob([newest.jpeg as Uint8Array<ArrayBuffer>], { type: "image/jpeg" });
        const image = await createImageBitmap(blob).catch(() => null);
        this.image?.close();
        this.image = image;
      }
      this.draw(newest);
    }
    this.isBusy = false;
  }

  clear(): void {
    this.host.hidden = true;
    this.image?.close();
    this.image = null;
  }

  private draw(frame: Frame): void {
    const { canvas, context } = this;
    this.host.hidden = false;
    const width = Math.round(272 * Math.min(2, window.devicePixelRatio));
    const scale = width / Math.max(1, frame.width_px);
    const height = Math.max(1, Math.round(frame.height_px * scale));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const style = getComputedStyle(this.host);
    context.fillStyle = style.getPropertyValue("--hover");
    context.fillRect(0, 0, width, height);
    if (this.image) context.drawImage(this.image, 0, 0, width, height);
    const { seen, free } = FEATURE_LOOKS;
    const size = canvas.width / 272;
    const numSeen = drawDots(context, frame, (state) => state === 1, scale, seen.colour, seen.radius * size);
    const numFree = drawDots(context, frame, (state) => state === 0, scale, free.colour, free.radius * size);
    setText(this.seen, `${numSeen} in the map`);
    setText(this.free, `${numFree} free`);
  }
}
