// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { MockServer } from "../dev/mock_server.mjs";
import { launch, open, pickSomething, picture, pressTwice, report, until } from "./chromium.mjs";

const isOpen = (w) => w.connection === "open" && !w.isLoading && w.generation > 0;

/** A mock server with a page on it; both are closed at the end of the case. */
async function serve({ browser, cleanUp }, options, view, path = "/") {
  const mock = new MockServer(options);
  cleanUp.push(() => mock.close());
  const port = await mock.listen(0);
  const url = `http://127.0.0.1:${port}${path}`;
  const openPage = (more = view) => open(browser, url, more);
  return { mock, port, openPage, page: await openPage() };
}

async function growsAndAgrees(context) {
  const { mock, page, openPage } = await serve(context, { world: "walk", skip: 200 }, { isDark: true });
  await until(page, isOpen);
  const before = await report(page);
  assert.ok(before.landmarks > 0 && before.keyframes > 0 && before.trajectory > 0);
  await until(page, (w, b) => w.landmarks > b.landmarks && w.keyframes > b.keyframes && w.trajectory > b.trajectory, before);
  await until(page, (w) => w.agreement.equal >= 10);
  assert.equal((await report(page)).agreement.different, 0);
  const late = await openPage({ isPhone: true, isDark: true });
  await until(late, isOpen);
  assert.ok((await report(late)).landmarks >= before.landmarks, "a late browser sees the whole map");
  await until(late, (w) => w.agreement.equal >= 3);
  assert.equal(mock.sockets.clients.size, 2);
  mock.hold();
  await picture(page, `${context.pictures}/desktop_dark.png`);
  await picture(late, `${context.pictures}/phone_dark.png`);
  await late.tap("#open-sheet");
  await late.waitForTimeout(400);
  await picture(late, `${context.pictures}/phone_sheet.png`);
  assert.deepEqual([...page.problems, ...late.problems], []);
}

async function controlsAct(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 100 });
  await until(page, isOpen);
  const press = (control) => page.click(`[data-control=${control}]`);
  await press("pause");
  await until(page, (w) => w.session.phase === "paused");
  await page.waitForFunction(() => document.querySelector("[data-control=pause]").textContent === "Resume");
  await press("pause");
  await until(page, (w) => w.session.phase === "running");
  await press("mapping");
  await until(page, (w) => !w.session.is_mapping);
  await page.waitForFunction(() => document.querySelector("[data-control=mapping]").textContent === "Go on mapping");
  await press("mapping");
  await until(page, (w) => w.session.is_mapping);
  await press("save");
  await page.waitForFunction(() => document.querySelector("#controls").textContent.includes("Saved to courtyard.wmap"));
  const { generation } = await report(page);
  await press("reset");
  assert.ok(!mock.requests.some((request) => request.do === "reset"), "it asks first");
  await pressTwice(page, "reset");
  await until(page, (w, g) => w.generation > g && !w.isLoading, generation);
  await pressTwice(page, "stop");
  await until(page, (w) => w.session.phase === "done");
  assert.deepEqual(mock.requests.map((request) => request.do), ["pause", "resume", "mapping", "mapping", "save", "reset", "stop"]);
  assert.deepEqual(page.problems, []);
}

async function looksFromEverywhere(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 900 });
  await until(page, isOpen);
  mock.hold();
  await until(page, (w) => w.view === "follow");
  for (const view of ["orbit", "top", "follow"]) {
    await page.click(`#view-choice [data-value=${view}]`);
    await until(page, (w, v) => w.view === v, view);
  }
  for (const colouring of ["image", "height", "age", "observations", "part"]) {
    await page.click(`#colouring-choice [data-value=${colouring}]`);
    await until(page, (w, c) => w.colouring === c, colouring);
  }
  await page.click("[data-layer=covisibility]");
  assert.equal(await page.getAttribute("[data-layer=covisibility]", "aria-pressed"), "true");
  await page.click("#view-choice [data-value=top]");
  await page.click("#colouring-choice [data-value=height]");
  await picture(page, `${context.pictures}/desktop_top_light.png`);
  const download = page.waitForEvent("download");
  await page.click("#screenshot");
  assert.match((await download).suggestedFilename(), /^waymark-.*\.png$/);
  const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
  assert.equal(await theme(), "light");
  await page.click("#theme");
  assert.equal(await theme(), "dark");
  assert.deepEqual(page.problems, []);
}

async function showsWhatIsClicked(context) {
  const { page } = await serve(context, { world: "map", skip: 700 });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  await page.waitForTimeout(1500);
  await pickSomething(page);
  await page.waitForSelector("#inspector .link");
  const { selected } = await report(page);
  assert.match(await page.innerText("#inspector h2"), new RegExp(`${selected.id}$`));
  await page.click("#inspector .link");
  await until(page, (w) => w.selected.kind === "keyframe");
  await page.waitForFunction(() => document.querySelector("#inspector").textContent.includes("Shares landmarks with"));
  await picture(page, `${context.pictures}/desktop_keyframe.png`);
  await page.keyboard.press("Escape");
  await until(page, (w) => w.selected === null);
  assert.deepEqual(page.problems, []);
}

/** Whether a colour is anywhere on the map, away from what lies above it. */
async function hasColour(page, wanted) {
  const png = await page.screenshot({ clip: { x: 480, y: 250, width: 190, height: 200 } });
  return page.evaluate(async ([base64, rgb]) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 0, picture.width, picture.height);
    for (let i = 0; i < data.length; i += 4) if (rgb.every((value, k) => data[i + k] === value)) return true;
    return false;
  }, [png.toString("base64"), wanted]);
}

/** Parts and keyframes are listed; what is chosen is shown, in the colour of the theme, with its place in the unit of the map. */
async function goesToKeyframesAndParts(context) {
  const { page } = await serve(context, { world: "map", skip: 700, isFree: true }, { isDark: true });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  const { keyframes } = await report(page);
  await page.waitForFunction((n) => document.querySelector("#places-list").textContent.includes(`: ${n} keyframes`), keyframes);
  await page.click("[data-layer=markers]"); // Whose squares are white and dark, too.
  await page.click("#places summary");
  await page.waitForFunction((n) => document.querySelectorAll("#places .link").length === n + 1, keyframes);
  await page.click("#places .link:has-text('Whole part')");
  await until(page, (w) => w.view === "orbit");
  await page.locator("#places .link", { hasText: /^5$/ }).click();
  await until(page, (w) => w.selected?.kind === "keyframe" && w.selected.id === 5);
  await page.waitForFunction(() => document.querySelector("#inspector dl")?.textContent.includes(" map units"));
  await page.waitForTimeout(1500);
  assert.ok(await hasColour(page, [255, 255, 255]), "what is selected is white in the dark");
  await picture(page, `${context.pictures}/desktop_places_dark.png`);
  await page.click("#theme");
  await page.waitForTimeout(500);
  assert.ok(await hasColour(page, [0x12, 0x18, 0x1f]), "and nearly black in the light");
  await picture(page, `${context.pictures}/desktop_places_light.png`);
  assert.match(await page.innerText("#ramp-low"), / map units$/);
  assert.deepEqual(page.problems, []);
}

/** Help comes and goes with its key and its button. */
async function helps(context) {
  const { page } = await serve(context, { world: "map", skip: 300 });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  await page.keyboard.press("?");
  assert.match(await page.innerText("#help-panel"), /measure between two places/);
  await picture(page, `${context.pictures}/desktop_help.png`);
  await page.keyboard.press("Escape");
  assert.ok(await page.isHidden("#help-panel"));
  await page.click("#help");
  await page.click("#help-panel form button");
  assert.ok(await page.isHidden("#help-panel"));
  const lengths = await page.$$eval("#axes g:not([hidden]) line", (lines) => lines.map((line) => Math.hypot(line.x2.baseVal.value, line.y2.baseVal.value)));
  assert.ok(lengths.length === 3 && Math.max(...lengths) > 10, "the axes are drawn");
  assert.deepEqual(page.problems, []);
}

async function playsTheSession(context) {
  const { page } = await serve(context, { world: "map", skip: 700 });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  const time = async () => Number(await page.getAttribute("#profile", "aria-valuenow"));
  const box = await page.locator("#profile").boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await page.waitForFunction(() => Math.abs(Number(document.querySelector("#profile").getAttribute("aria-valuenow")) - 17.5) < 1);
  const before = await time();
  await page.click("#play");
  await page.waitForFunction((t) => Number(document.querySelector("#profile").getAttribute("aria-valuenow")) > t + 0.5, before);
  await page.click("#play");
  assert.deepEqual(page.problems, []);
}

async function connectsAgain(context) {
  const { mock, port, page } = await serve(context, { world: "walk", skip: 300 });
  await until(page, isOpen);
  const before = await report(page);
  await mock.close();
  await until(page, (w) => w.connection === "waiting");
  await page.waitForSelector("#banner:not([hidden])");
  assert.ok((await report(page)).landmarks >= before.landmarks, "the last map stays");
  await picture(page, `${context.pictures}/desktop_no_connection.png`);
  const restarted = new MockServer({ world: "walk", skip: 100 });
  context.cleanUp.push(() => restarted.close());
  await restarted.listen(port);
  await until(page, isOpen);
  await until(page, (w, b) => w.landmarks > 0 && w.landmarks < b.landmarks && w.agreement.equal > b.agreement.equal, before);
  await page.waitForSelector("#banner", { state: "hidden" });
  assert.deepEqual(page.problems, []);
}

/** That a session is done stays to be read when the program leaves, as it does then; only what broke off is a lost connection. */
async function remembersTheEnd(context) {
  const { mock, port, page } = await serve(context, { world: "walk", skip: 100 });
  await until(page, isOpen);
  mock.phase = "done";
  await until(page, (w) => w.session.phase === "done");
  await mock.close();
  await until(page, (w) => w.connection === "waiting");
  await page.waitForFunction(() => document.querySelector("#state-detail").textContent.endsWith("The program has ended"));
  assert.equal(await page.innerText("#state-name"), "Finished");
  assert.ok(await page.isHidden("#banner"));
  const restarted = new MockServer({ world: "walk", skip: 100 });
  context.cleanUp.push(() => restarted.close());
  await restarted.listen(port);
  await until(page, (w) => w.connection === "open" && w.session.phase === "running");
  await restarted.close();
  await page.waitForFunction(() => document.querySelector("#state-name").textContent === "No connection");
  assert.deepEqual(page.problems, []);
}

async function saysWhatIsMissing(context) {
  const { mock, page } = await serve(context, { world: "empty" }, { isPhone: true });
  await page.waitForFunction(() => document.querySelector("#notice-title").textContent === "Waiting for the first image");
  await picture(page, `${context.pictures}/phone_empty.png`);
  mock.doing = "calibration: round 2: focal length 512.0 px";
  mock.broadcast(JSON.stringify(mock.status()));
  await page.waitForFunction(() => document.querySelector("#notice-text").textContent === "Calibration: round 2: focal length 512.0 px.");
  const loading = await serve(context, { world: "loading" });
  await loading.page.waitForFunction(() => document.querySelector("#notice-title").textContent === "Loading the map");
  assert.equal(await loading.page.innerText("#state-detail"), "Loading the map");
  const refused = await serve(context, { world: "walk", skip: 100, token: "0123456789abcdef" });
  await until(refused.page, (w) => w.connection === "refused");
  await refused.page.waitForFunction(() => document.querySelector("#notice-title").textContent === "This address needs its token");
  const right = await serve(context, { world: "walk", skip: 100, token: "0123456789abcdef" }, {}, "/?token=0123456789abcdef");
  await until(right.page, isOpen);
}

async function worksWithoutWebGl({ cleanUp, pictures }) {
  const browser = await launch(["--disable-3d-apis"]);
  cleanUp.push(() => browser.close());
  const { page } = await serve({ browser, cleanUp }, { world: "walk", skip: 200 });
  await page.waitForFunction(() => document.querySelector("#notice-title").textContent === "This browser offers no WebGL");
  await until(page, (w) => w.connection === "open" && w.agreement.equal >= 3 && w.keyframes > 0);
  assert.equal((await report(page)).agreement.different, 0);
  assert.equal(await page.innerText("#state-name"), "Tracking");
  for (const button of ["#fit", "#screenshot", "#theme", "#view-choice [data-value=top]", "#colouring-choice [data-value=age]"]) {
    await page.click(button);
  }
  await page.click("[data-control=pause]");
  await until(page, (w) => w.session.phase === "paused");
  await picture(page, `${pictures}/desktop_no_webgl.png`);
  assert.deepEqual(page.problems.filter((problem) => !problem.includes("WebGL context")), []);
}

/** What the images say of the calibration, as soon as they do and no longer than they do. */
async function tellsOfTheCalibration(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 100 });
  await until(page, isOpen);
  assert.ok(await page.isHidden("#calibration"));
  mock.calibration = [
    { name: "cam0.fu", given: 458.654, change: 2.6513, sigma: 0.2345 },
    { name: "cam1.turn_y", given: 0, change: -0.00203, sigma: 0.000031 },
  ];
  await page.waitForSelector("#calibration:not([hidden])");
  const cells = await page.$$eval("#calibration tr", (rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent)));
  assert.deepEqual(cells.slice(1), [["cam0.fu", "458.65", "461.31", "0.23"], ["cam1.turn_y, mrad", "0.000", "-2.030", "0.031"]]);
  const fits = await page.$eval("#calibration", (panel) => panel.scrollWidth <= panel.clientWidth);
  assert.ok(fits, "it is no wider than its place");
  await picture(page, `${context.pictures}/desktop_calibration.png`);
  mock.calibration = [];
  await page.waitForSelector("#calibration", { state: "hidden" });
  assert.deepEqual(page.problems, []);
}

/** What the IMU of a session tells, and nothing of a session without; gravity is downwards in the picture. */
async function tellsOfTheImu(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 200, isFree: true });
  await until(page, isOpen);
  assert.ok(await page.isHidden("#imu") && (await page.isHidden("#axes .gravity")));
  const saysSoon = (words) => page.waitForFunction((text) => document.querySelector("#imu").innerText.includes(text), words);
  mock.imu = { rate_hz: 199.96, is_used: false, reason: "", submap: null, metric_submap: null, gravity: null, velocity_m_s: null };
  await page.waitForSelector("#imu:not([hidden])");
  await saysSoon("Not compared with the images yet");
  assert.ok(await page.isHidden("#imu-facts"));
  mock.imu = { ...mock.imu, reason: "it contradicts the images" };
  await saysSoon("Not used: it contradicts the images");
  mock.imu = { ...mock.imu, is_used: true, reason: "", submap: 0, gravity: [0, 0.8, 0.6] };
  await saysSoon("not yet");
  assert.equal(await page.innerText("#imu-speed"), "–");
  assert.match(await page.innerText("#scale"), / map units?$/);
  mock.imu = { ...mock.imu, metric_submap: 0, gravity: [0, 0, -1], velocity_m_s: [0.3, 0, -0.4] };
  await saysSoon("yes, z up");
  assert.deepEqual([await page.innerText("#imu-speed"), await page.innerText("#imu-rate")], ["0.50 m/s", "200 Hz"]);
  await page.waitForFunction(() => {
    const [x, y] = ["x2", "y2"].map((name) => Number(document.querySelector("#axes .gravity line").getAttribute(name)));
    return Math.abs(x) < 1 && y > 10;
  });
  await page.waitForFunction(() => document.querySelector("#scale").textContent.endsWith(" m"));
  await picture(page, `${context.pictures}/desktop_imu.png`);
  mock.imu = undefined;
  await page.waitForSelector("#imu", { state: "hidden" });
  assert.deepEqual(page.problems, []);
}

/** The page is as wide as its window and the picture as wide as its place, whatever they were before. */
async function followsItsWindow(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 200 }, { size: { width: 1280, height: 800 } });
  await until(page, isOpen);
  mock.hold();
  for (const size of [{ width: 390, height: 844 }, { width: 800, height: 400 }, { width: 1280, height: 800 }]) {
    await page.setViewportSize(size);
    await page.waitForFunction((width) => {
      const { clientWidth, clientHeight } = document.querySelector("#stage");
      const { width: drawn, height } = document.querySelector("#scene");
      const isNarrow = width <= 800;
      const sizes = [document.documentElement.scrollWidth, document.querySelector("#timeline").offsetWidth, clientWidth];
      const expected = [width, isNarrow ? width : width - 288, isNarrow ? width : width - 288];
      return String([...sizes, drawn, height]) === String([...expected, clientWidth, clientHeight]);
    }, size.width);
  }
  assert.deepEqual(page.problems, []);
}

/** The picture is as dense as the screen that the window comes to. */
async function followsItsScreen(context) {
  const { page } = await serve(context, { world: "walk", skip: 200 });
  await until(page, isOpen);
  const device = await page.context().newCDPSession(page);
  for (const deviceScaleFactor of [2, 1]) {
    await device.send("Emulation.setDeviceMetricsOverride", { width: 960, height: 640, deviceScaleFactor, mobile: false });
    await page.waitForFunction((ratio) => {
      const canvas = document.querySelector("#scene");
      return canvas.width === ratio * canvas.clientWidth && canvas.height === ratio * canvas.clientHeight;
    }, deviceScaleFactor);
  }
  assert.deepEqual(page.problems, []);
}

/** Presses landmarks or keyframes until two are measured between. */
async function measureSomething(page) {
  const box = await page.locator("#scene").boundingBox();
  for (let i = 0; i < 120; ++i) {
    const [x, y] = [0.3 + (0.4 * ((7 * i) % 11)) / 11, 0.25 + (0.3 * ((5 * i) % 13)) / 13];
    await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
    const measured = await page.evaluate(() => window.waymark.measured);
    if (measured) return measured;
  }
  throw new Error("nothing was hit");
}

/** A length that somebody knows gives all others metres, and a saved map is written with them where a file was named. */
async function measuresAndScales(context) {
  for (const isPhone of [false, true]) {
    const options = { world: "map", skip: 700, isFree: true, out: "scaled.wmap" };
    const { mock, page } = await serve(context, options, { isPhone });
    await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
    await page.waitForTimeout(1500);
    await page.click("#measure");
    assert.match(await page.innerText("#measure-panel"), /Click two places/);
    const { value, unit } = await measureSomething(page);
    assert.ok(unit === "map units" && value > 0);
    assert.equal(await page.evaluate(() => window.waymark.selected), null, "it is not selected, too");
    await page.fill("#measure-panel input", "none");
    await page.click("#measure-panel form button");
    assert.match(await page.innerText("#measure-panel"), /Expected a number/);
    await page.fill("#measure-panel input", "2,5");
    await page.click("#measure-panel form button");
    await until(page, (w) => w.measured.unit === "m" && Math.abs(w.measured.value - 2.5) < 1e-9);
    await page.waitForFunction(() => document.querySelector("#scale").textContent.endsWith(" m"));
    await page.click("[data-control=scale]");
    await page.waitForFunction(() => document.querySelector("#measure-panel").textContent.includes("Written to scaled.wmap"));
    const asked = mock.requests.at(-1);
    assert.deepEqual([asked.do, asked.metres, Object.keys(asked.a).length, Object.keys(asked.b).length], ["scale", 2.5, 1, 1]);
    await picture(page, `${context.pictures}/${isPhone ? "phone" : "desktop"}_measure.png`);
    const fits = await page.$eval("#measure-panel", (panel) => panel.scrollWidth <= panel.clientWidth && panel.getBoundingClientRect().left >= 0);
    assert.ok(fits, "it is no wider than its place");
    await page.keyboard.press("Escape");
    assert.ok(await page.isHidden("#measure-panel"));
    assert.deepEqual(page.problems, []);
  }
}

/** Of maps in metres and of those that nobody may write. */
async function measuresOnly(context) {
  const metric = await serve(context, { world: "map", skip: 700 });
  await until(metric.page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  await metric.page.waitForTimeout(1500);
  await metric.page.keyboard.press("m");
  assert.equal((await measureSomething(metric.page)).unit, "m");
  assert.ok(await metric.page.isHidden("#measure-panel form"));
  const free = await serve(context, { world: "map", skip: 700, isFree: true });
  await until(free.page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  await free.page.waitForTimeout(1500);
  await free.page.keyboard.press("m");
  await measureSomething(free.page);
  await free.page.fill("#measure-panel input", "4");
  await free.page.keyboard.press("Enter");
  const command = await free.page.innerText("#measure-panel code");
  assert.match(command, /^waymark map align courtyard.wmap --distance L?\d+ L?\d+ 4 -o scaled.wmap$/);
  assert.ok(!free.mock.requests.some((request) => request.do === "scale"));
  assert.deepEqual([...metric.page.problems, ...free.page.problems], []);
}

/** A keyframe's image with its features, large on request; or why there is none. */
async function showsKeyframeImages(context) {
  for (const isPhone of [false, true]) {
    const { page } = await serve(context, { world: "map", skip: 700 }, { isPhone });
    await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
    await page.waitForTimeout(1500);
    await pickSomething(page);
    await page.waitForSelector("#inspector .link");
    if ((await report(page)).selected.kind === "landmark") await page.click("#inspector .link");
    await page.waitForSelector("#inspector .keyframe-image[data-shown]");
    assert.match(await page.innerText("#inspector figcaption"), /^150 features with a landmark, 150 free; on edges: 150 of all$/);
    const colours = await page.$eval("#inspector canvas", (canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return new Set(Array.from({ length: data.length / 400 }, (_, i) => data[400 * i])).size;
    });
    assert.ok(colours > 5, "there is a picture");
    await picture(page, `${context.pictures}/${isPhone ? "phone" : "desktop"}_keyframe_image.png`);
    const before = (await page.locator("#inspector").boundingBox()).width;
    await page.click("#inspector .picture");
    const large = await page.locator("#inspector").boundingBox();
    assert.ok(isPhone ? large.width >= before : large.width > 1.5 * before);
    const shown = await page.locator("#inspector canvas").boundingBox();
    assert.ok(shown.width > 0.85 * large.width && Math.abs(shown.width / shown.height - 752 / 480) < 0.02, "as wide as high as it was taken");
    assert.deepEqual(page.problems, []);
  }
  const { page } = await serve(context, { world: "map", skip: 700, images: "none" });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.keyframes > 0);
  await page.waitForTimeout(1500);
  await pickSomething(page);
  await page.waitForSelector("#inspector .link");
  if ((await report(page)).selected.kind === "landmark") await page.click("#inspector .link");
  await page.waitForFunction(() => document.querySelector("#inspector").textContent.includes("No image: its image was not kept"));
  assert.deepEqual(page.problems, []);
}

/** Markers are squares with their numbers, which can be left out; maps without markers have no switch for them. */
async function showsMarkersAndEdges(context) {
  const { mock, page } = await serve(context, { world: "walk", skip: 700 });
  await until(page, (w) => w.connection === "open" && !w.isLoading && w.markers === 4 && w.edgePoints > 100);
  mock.hold();
  await page.click("#view-choice [data-value=orbit]");
  await picture(page, `${context.pictures}/desktop_markers.png`);
  const before = await page.evaluate(() => window.waymark.performance.drawCalls);
  await page.click("[data-layer=markers]");
  // Squares and signs are a draw call each.
  await until(page, (w, b) => w.performance.drawCalls === b - 2, before);
  const large = await serve(context, { world: "empty" });
  await large.page.waitForFunction(() => document.querySelector("[data-layer=markers]").hidden);
  const phone = await serve(context, { world: "map", skip: 700 }, { isPhone: true, isDark: true });
  await until(phone.page, (w) => !w.isLoading && w.markers === 4);
  await picture(phone.page, `${context.pictures}/phone_markers.png`);
  assert.deepEqual([...page.problems, ...phone.page.problems], []);
}

/** Half a million landmarks and five thousand keyframes. Times are told, not judged: they depend on the machine. */
async function drawsLargeMaps(context) {
  const { page } = await serve(context, { world: "large" }, { isDark: true, size: { width: 800, height: 500 } });
  await until(page, (w) => w.landmarks === 500000 && w.keyframes === 5000 && !w.isLoading);
  await page.click("[data-layer=covisibility]");
  await page.click("[data-layer=tree]");
  await page.waitForTimeout(2000);
  await page.evaluate(() => window.waymark.resetPerformance());
  await until(page, (w) => w.performance.script_ms.count >= 3);
  const { performance } = await report(page);
  console.log(`        ${JSON.stringify(performance)}`);
  assert.ok(performance.drawCalls > 5 && performance.drawCalls <= 50);
  assert.deepEqual(page.problems, []);
}

export const mockCases = [
  growsAndAgrees, controlsAct, looksFromEverywhere, showsWhatIsClicked, goesToKeyframesAndParts, helps, playsTheSession, connectsAgain, remembersTheEnd,
  measuresAndScales, measuresOnly, showsKeyframeImages, showsMarkersAndEdges, saysWhatIsMissing, worksWithoutWebGl, tellsOfTheCalibration, tellsOfTheImu,
  followsItsWindow, followsItsScreen, drawsLargeMaps,
];
