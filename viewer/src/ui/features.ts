// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

/** What is drawn of the features of an image. */
interface Dots {
  pixel: Float32Array;
  state: Uint8Array;
}

export const FEATURE_LOOKS = {
  seen: { colour: "#5fe0b5", radius: 2.1 },
  free: { colour: "rgba(240, 190, 80, 0.65)", radius: 1.3 },
};

/** Dots on the features of one state, `scale` pixels of the canvas to one of the image; how many there are. */
export function drawDots(
  context: CanvasRenderingContext2D, { pixel, state }: Dots, isShown: (state: number) => boolean, scale: number, colour: string, radius: number,
): number {
  let count = 0;
  context.fillStyle = colour;
  context.beginPath();
  for (let i = 0; i < state.length; ++i) {
    if (!isShown(state[i]!)) continue;
    const x = (pixel[2 * i]! + 0.5) * scale;
    const y = (pixel[2 * i + 1]! + 0.5) * scale;
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
    ++count;
  }
  context.fill();
  return count;
}
