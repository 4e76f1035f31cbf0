// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { chromium } from "playwright-core";

const FLAGS = [
  "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
  "--disable-background-networking", "--disable-component-update", "--disable-sync",
];

/** Chromium without a window, which draws in software. */
export function launch() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, args: FLAGS });
}

/** A page on `url`, as large as a desktop's window or as a phone; complaints of the page are collected in `problems`. */
export async function open(browser, url, { isPhone = false, isDark = false, size } = {}) {
  const viewport = size ?? (isPhone ? { width: 390, height: 844 } : { width: 1440, height: 900 });
  const context = await browser.newContext({
    viewport, deviceScaleFactor: isPhone ? 2 : 1, isMobile: isPhone, hasTouch: isPhone, colorScheme: isDark ? "dark" : "light",
    acceptDownloads: true,
  });
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
