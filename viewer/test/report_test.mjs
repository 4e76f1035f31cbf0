// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

// Pages of `waymark report` in a real browser, as wide as a desktop's and as a phone's.
//
// usage: node test/report_test.mjs PICTURES PAGE.html...
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { basename, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { launch } from "./chromium.mjs";

const SIZES = { desktop: { width: 1200, height: 800 }, phone: { width: 390, height: 844 } };

/** What does not fit into the window, and what cannot be read. */
const faults = () => {
  const found = [];
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width) found.push(`wider than the window: ${document.documentElement.scrollWidth} px`);
  for (const text of document.querySelectorAll("svg text")) {
    const { a, b } = text.getScreenCTM(); // Some are turned.
    const scale = Math.hypot(a, b);
    if (13 * scale < 9) found.push(`text of ${(13 * scale).toFixed(1)} px`);
  }
  for (const path of document.querySelectorAll("path")) {
    if (/nan|inf/i.test(path.getAttribute("d"))) found.push("a path with a number that is none");
  }
  if (document.documentElement.lang !== "en" || !document.title) found.push("no language or no title");
  if (document.querySelectorAll("h1").length !== 1) found.push("not one heading");
  for (const drawing of document.querySelectorAll("svg[role=img]")) {
    if (!drawing.getAttribute("aria-label")) found.push("a drawing without a name");
  }
  return found;
};

async function look(page, size, path) {
  assert.deepEqual(await page.evaluate(faults), []);
  const timeline = page.locator("#timeline");
  if (await timeline.count()) {
    await timeline.scrollIntoViewIfNeeded();
    const box = await timeline.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    const told = await page.locator("#readout").textContent();
    assert.match(told, /^Frame \d+ at [\d.]+ s: \w+/, `${size}: the timeline tells ${told}`);
    await page.mouse.move(0, 0);
    await page.evaluate(() => scrollTo(0, 0));
  }
  await page.screenshot({ path, fullPage: true });
}

const [pictures, ...pages] = process.argv.slice(2);
assert(pages.length > 0, "expected pages to open");
mkdirSync(pictures, { recursive: true });
const browser = await launch();
for (const file of pages) {
  for (const [size, viewport] of Object.entries(SIZES)) {
    const context = await browser.newContext({ viewport, isMobile: size === "phone" });
    const page = await context.newPage();
    const problems = [];
    page.on("pageerror", (error) => problems.push(String(error.stack ?? error)));
    page.on("console", (message) => problems.push(message.text()));
    page.on("request", (request) => {
      if (!request.url().startsWith("file:")) problems.push(`asks for ${request.url()}`);
    });
    await page.goto(pathToFileURL(resolve(file)).href);
    await look(page, size, `${pictures}/${basename(file, ".html")}-${size}.png`);
    assert.deepEqual(problems, [], `${file}, ${size}`);
    await context.close();
  }
  console.log(`ok      ${file}`);
}
await browser.close();
