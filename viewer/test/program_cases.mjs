// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { createServer as createHttpServer } from "node:http";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { open, PATIENCE_MS, picture, pickSomething, pressTwice, report, until } from "./chromium.mjs";

const isOpen = (w) => w.connection === "open" && !w.isLoading && w.generation > 0;

/** A port that nobody listens on. */
function freePort() {
  return new Promise((resolve) => {
    const server = createServer();
    server.listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

/** Starts the program and waits until it serves; it is ended with the case. */
async function start({ waymark, cleanUp }, port, ...args) {
  const child = spawn(waymark, args, { stdio: ["ignore", "pipe", "pipe"] });
  let output = "";
  child.stdout.on("data", (data) => (output += data));
  child.stderr.on("data", (data) => (output += data));
  const ended = new Promise((resolve) => child.on("exit", resolve));
  const end = async () => {
    child.kill("SIGINT");
    const timer = setTimeout(() => child.kill("SIGKILL"), 20000);
    const status = await ended;
    clearTimeout(timer);
    return status;
  };
  cleanUp.push(end);
  for (let i = 0; i < PATIENCE_MS / 100 && child.exitCode === null; ++i) {
    const answer = await fetch(`http://127.0.0.1:${port}/status`).catch(() => null);
    if (answer?.ok) return { end, ended, output: () => output };
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`the program does not serve:\n${output}`);
}

function folder({ cleanUp }) {
  const made = mkdtempSync(join(tmpdir(), "waymark-"));
  cleanUp.push(() => rmSync(made, { recursive: true, force: true }));
  return made;
}

const status = async (port) => (await fetch(`http://127.0.0.1:${port}/status`)).json();

/** The page's counts are those of the engine once the session stands still. */
async function agrees(page, port) {
  await until(page, (w) => w.session.landmarks === w.landmarks && w.session.keyframes === w.keyframes);
  const [engine, shown] = [await status(port), await report(page)];
  assert.deepEqual([shown.landmarks, shown.keyframes], [engine.landmarks, engine.keyframes]);
  return { engine, shown };
}

async function showsARun(context) {
  const out = folder(context);
  const port = await freePort();
  const args = [context.input, "--viewer", String(port), "--pace", "0.05", "-o", out, "--map-out", join(out, "map.wmap")];
  const program = await start(context, port, "run", ...args);
  const page = await open(context.browser, `http://127.0.0.1:${port}/`, { isDark: true });
  await until(page, (w) => w.connection === "open" && w.landmarks > 0 && w.keyframes > 0 && w.trajectory > 0);
  const first = await report(page);
  await until(page, (w, b) => w.keyframes > b.keyframes && w.landmarks !== b.landmarks && w.trajectory > b.trajectory, first);
  const press = (control) => page.click(`[data-control=${control}]`);
  await press("pause");
  await until(page, (w) => w.session.phase === "paused");
  const { shown } = await agrees(page, port);
  assert.ok(shown.trajectory > 0.5 * shown.frames);

  const late = await open(context.browser, `http://127.0.0.1:${port}/`, { isPhone: true });
  await until(late, isOpen);
  const other = (await agrees(late, port)).shown;
  assert.deepEqual([other.landmarks, other.keyframes, other.frames], [shown.landmarks, shown.keyframes, shown.frames]);
  await picture(late, `${context.pictures}/program_phone_light.png`);
  assert.deepEqual(late.problems, []);
  await late.context().close();

  await press("save");
  await page.waitForFunction(() => document.querySelector("#controls").textContent.includes("Saved to"));
  assert.ok(existsSync(join(out, "map.wmap")));
  await pickSomething(page);
  await page.waitForSelector("#inspector .link");
  await page.keyboard.press("Escape");
  await press("mapping");
  await until(page, (w) => !w.session.is_mapping);
  await press("mapping");
  await until(page, (w) => w.session.is_mapping);
  await press("pause");
  await until(page, (w) => w.session.phase === "running");
  await until(page, (w, b) => w.frames > b.frames + 5, shown);
  await press("pause"); // Whatever the browser takes: the input does not end before the end is asked for.
  await until(page, (w) => w.session.phase === "paused");
  await picture(page, `${context.pictures}/program_desktop_dark.png`);

  const { generation } = await report(page);
  await pressTwice(page, "reset");
  await until(page, (w, g) => w.generation > g && !w.isLoading, generation);
  await pressTwice(page, "stop");
  await until(page, (w) => w.connection === "waiting");
  assert.equal(await program.ended, 0, program.output());
  assert.deepEqual(page.problems, []);
}

/** A page of another site must not get at the controls by showing ours inside of it. */
async function refusesToBeFramed(context) {
  const out = folder(context);
  const port = await freePort();
  await start(context, port, "run", context.input, "--viewer", String(port), "--pace", "0.2", "-o", out);
  const url = `http://127.0.0.1:${port}/`;
  const foreign = createHttpServer((_, response) => {
    response.writeHead(200, { "content-type": "text/html" });
    response.end(`<!doctype html><iframe src="${url}"></iframe>`);
  });
  await new Promise((resolve) => foreign.listen(0, "127.0.0.1", resolve));
  context.cleanUp.push(() => foreign.close());
  const page = await context.browser.newPage();
  const refusal = page.waitForEvent("console", { predicate: (message) => message.text().includes("frame-ancestors"), timeout: PATIENCE_MS });
  await page.goto(`http://127.0.0.1:${foreign.address().port}/`);
  await refusal;
  assert.equal((await status(port)).clients, 0);
}

async function outlivesARestart(context) {
  const out = folder(context);
  const port = await freePort();
  const args = ["run", context.input, "--viewer", String(port), "--pace", "2", "-o", out, "--map-out", join(out, "map.wmap")];
  const first = await start(context, port, ...args);
  const page = await open(context.browser, `http://127.0.0.1:${port}/`);
  await until(page, (w) => w.connection === "waiting" && w.landmarks > 0);
  assert.equal(await first.ended, 0, first.output());
  const shown = await report(page);
  assert.deepEqual([shown.landmarks, shown.keyframes], [shown.session.landmarks, shown.session.keyframes], "the last map stays");
  const [, keyframes, landmarks] = first.output().match(/(\d+) keyframes, (\d+) landmarks/).map(Number);
  assert.deepEqual([shown.landmarks, shown.keyframes], [landmarks, keyframes], "it is what the program says at its end");
  assert.equal(shown.session.phase, "done");
  assert.equal(await page.innerText("#state-name"), "Finished");
  assert.match(await page.innerText("#state-detail"), /frames have a pose. The program has ended$/);

  await start(context, port, "view", join(out, "map.wmap"), "--port", String(port));
  // Its keyframes stand for the trajectory; until its snapshot comes, the page shows that of the run.
  await until(page, (w) => w.connection === "open" && w.session.phase === "map" && w.trajectory === w.keyframes);
  const saved = (await agrees(page, port)).shown;
  assert.deepEqual([saved.landmarks, saved.keyframes], [shown.landmarks, shown.keyframes], "the saved map is that of the run");
  await picture(page, `${context.pictures}/program_map_light.png`);
  assert.deepEqual(page.problems, []);
}

/** A saved map of one camera: images of its keyframes, and a length that makes metres of it, which the program writes. */
async function scalesASavedMap(context) {
  const out = folder(context);
  const [map, scaled] = [join(out, "mono.wmap"), join(out, "scaled.wmap")];
  const port = await freePort();
  const args = ["run", context.input, "--setup", "mono", "--viewer", String(port), "--pace", "0.15", "--keep-images", "-o", out, "--map-out", map];
  const run = await start(context, port, ...args);
  // At once: while the session draws, the page may be too slow for a mouse that waits for it to rest.
  const press = (page, selector) => page.$eval(selector, (element) => element.click());
  const size = { width: 820, height: 520 };
  const live = await open(context.browser, `http://127.0.0.1:${port}/`, { size });
  await until(live, (w) => w.connection === "open" && w.landmarks > 0 && w.keyframes > 1);
  await press(live, "[data-control=pause]");
  await until(live, (w) => w.session.phase === "paused");
  await press(live, "#view-choice [data-value=orbit]");
  await live.waitForTimeout(1500);
  await showsAnImage(live);
  await press(live, "[data-control=stop]");
  await press(live, "[data-control=stop]");
  assert.equal(await run.ended, 0, run.output());
  await live.context().close();

  const view = await freePort();
  const program = await start(context, view, "view", map, "--port", String(view), "-o", scaled);
  const page = await open(context.browser, `http://127.0.0.1:${view}/`, { size });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.landmarks > 0 && w.trajectory === w.keyframes);
  await page.waitForTimeout(1500);
  await showsAnImage(page);
  await picture(page, `${context.pictures}/program_keyframe_image.png`);
  await page.keyboard.press("Escape");
  await page.keyboard.press("m");
  const box = await page.locator("#scene").boundingBox();
  for (let i = 0; i < 120 && !(await page.evaluate(() => window.waymark.measured)); ++i) {
    await page.mouse.click(box.x + (0.35 + 0.3 * ((7 * i) % 11) / 11) * box.width, box.y + (0.35 + 0.3 * ((5 * i) % 13) / 13) * box.height);
  }
  assert.equal((await page.evaluate(() => window.waymark.measured)).unit, "map units");
  await page.fill("#measure-panel input", "3.5");
  await page.keyboard.press("Enter");
  await press(page, "[data-control=scale]");
  await page.waitForFunction(() => document.querySelector("#measure-panel").textContent.includes("Written to"));
  assert.ok(existsSync(scaled));
  assert.equal(await program.end(), 0, program.output());
  const info = execFileSync(context.waymark, ["map", "info", scaled], { encoding: "utf8" });
  assert.match(info, /in metres/);
  assert.deepEqual(page.problems, []);
}

/** Selects a keyframe and waits for its image. */
async function showsAnImage(page) {
  await pickSomething(page);
  await page.waitForSelector("#inspector .link");
  if ((await report(page)).selected.kind === "landmark") await page.click("#inspector .link");
  await page.waitForSelector("#inspector .keyframe-image[data-shown]");
  assert.match(await page.innerText("#inspector figcaption"), /^[1-9]\d* features? with a landmark/);
}

/** Need the program (`context.waymark`) and a sequence for it (`context.input`). */
export const programCases = [showsARun, refusesToBeFramed, outlivesARestart, scalesASavedMap];
