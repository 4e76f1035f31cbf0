// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { chromium } from "playwright-core";

// Debian's Chromium draws whole pages by the graphics processor. Where that is software, a page takes a second per picture.
const FLAGS = [
  "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas",
  "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
];

/** Longer than anything takes on a machine with other work. */
export const PATIENCE_MS = 180000;

/** Chromium without a window, which draws in software; with more flags if needed. */
export function launch(more = []) {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, args: [...FLAGS, ...more] });
}

/** A page on `url`, as large as a desktop's window or as a phone; complaints of the page are collected in `problems`. */
export async function open(browser, url, { isPhone = false, isDark = false, size } = {}) {
  const viewport = size ?? (isPhone ? { width: 390, height: 844 } : { width: 960, height: 640 });
  const context = await browser.newContext({
    viewport, deviceScaleFactor: isPhone ? 2 : 1, isMobile: isPhone, hasTouch: isPhone, colorScheme: isDark ? "dark" : "light",
    acceptDownloads: true,
  });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  page.problems = [];
  page.on("pageerror", (error) => page.problems.push(String(error.stack ?? error)));
  page.on("console", (message) => {
    const isExpected = message.text().includes("WebSocket connection") || message.text().includes("Failed to load resource");
    if (message.type() === "error" && !isExpected) page.problems.push(message.text());
  });
  await page.goto(url);
  await page.waitForFunction(() => "waymark" in window);
  return page;
}

/** What the page says of itself. */
export const report = (page) =>
  page.evaluate(() => {
    const { connection, session, generation, isLoading, sequence, landmarks, keyframes, trajectory, frames } = window.waymark;
    const { covisibilityEdges, loopEdges, view, colouring, selected, agreement, performance } = window.waymark;
    return {
      connection, session, generation, isLoading, sequence, landmarks, keyframes, trajectory, frames, covisibilityEdges, loopEdges,
      view, colouring, selected, agreement, performance,
    };
  });

/** Waits until the page says so; `condition` is evaluated in the page with its report. */
export async function until(page, condition, argument) {
  const check = new Function("argument", `return (${condition})(window.waymark, argument)`);
  await page.waitForFunction(check, argument, { timeout: PATIENCE_MS, polling: 100 });
}

/** Presses a control that asks first, and again before it forgets that, however slow the page is. */
export const pressTwice = (page, control) =>
  page.locator(`[data-control=${control}]`).evaluate((button) => {
    if (!button.classList.contains("sure")) button.click();
    button.click();
  });

/** Presses a keyframe or landmark near the middle of the map: tries places until something is hit. */
export async function pickSomething(page) {
  const box = await page.locator("#scene").boundingBox();
  for (let i = 0; i < 60; ++i) {
    const angle = 2.4 * i;
    const radius = 0.035 * Math.sqrt(i) * Math.min(box.width, box.height);
    await page.mouse.click(box.x + box.width / 2 + radius * Math.cos(angle), box.y + box.height / 2 + radius * Math.sin(angle));
    if (await page.evaluate(() => window.waymark.selected)) return;
  }
  throw new Error("nothing was hit");
}

/** A picture of the page when it has come to rest; desktops as large as people have them. */
export async function picture(page, path) {
  const before = page.viewportSize();
  if (before.width > 800) await page.setViewportSize({ width: 1440, height: 900 });
  await page.waitForTimeout(1500);
  await page.screenshot({ path });
  await page.setViewportSize(before);
}
