// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

// A server of docs/viewer-protocol.md without the program behind it, for work on the page and its tests.
//
// usage: node dev/mock_server.mjs [--port N] [--world walk|sphere|large|map|empty|loading|lost] [--skip FRAMES] [--token TOKEN]
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { WebSocketServer } from "ws";
import * as encode from "./encode.mjs";
import { largeMap, random, Walk } from "./world.mjs";

const CHUNK = 65536;
const STATES = ["initializing", "tracked", "filled", "lost", "unreadable", "dropped"];
const REASONS = [
  "none", "no_features", "too_little_parallax", "too_few_matches", "too_few_inliers", "no_candidate", "not_verified",
  "unreadable_image", "wrong_size", "late",
];
const STAGES = ["features", "depth", "wait", "predict", "local_map", "initialize", "recover", "keyframe"];
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };
/** As the program sends it, so that tests see what the page may not do. */
const POLICY = "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const DIST = fileURLToPath(new URL("../dist/", import.meta.url));

/** A picture of a corridor, 188 x 120 px. */
const JPEG = Buffer.from(
  "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABQODxIPDRQSEBIXFRQYHjIhHhwcHj0sLiQySUBMS0dARkVQWnNiUFVtVkVGZIhlbXd7gYKBTmCNl4x9lnN+gXz/2wBDAR" +
  "UXFx4aHjshITt8U0ZTfHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHx8fHz/wAARCAB4ALwDASIAAhEBAxEB/8QAHwAAAQUBAQEB" +
  "AQEAAAAAAAAAAAECAwQFBgcICQoL/8QAtRAAAgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS0fAkM2JyggkKFhcYGRolJicoKSo0NT" +
  "Y3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKjpKWmp6ipqrKztLW2t7i5usLDxMXGx8jJytLT1NXW19jZ2uHi4+Tl" +
  "5ufo6erx8vP09fb3+Pn6/8QAHwEAAwEBAQEBAQEBAQAAAAAAAAECAwQFBgcICQoL/8QAtREAAgECBAQDBAcFBAQAAQJ3AAECAxEEBSExBhJBUQdhcRMiMoEIFEKRob" +
  "HBCSMzUvAVYnLRChYkNOEl8RcYGRomJygpKjU2Nzg5OkNERUZHSElKU1RVVldYWVpjZGVmZ2hpanN0dXZ3eHl6goOEhYaHiImKkpOUlZaXmJmaoqOkpaanqKmqsrO0" +
  "tba3uLm6wsPExcbHyMnK0tPU1dbX2Nna4uPk5ebn6Onq8vP09fb3+Pn6/9oADAMBAAIRAxEAPwDZooooAKKKKACiiigAooooAKKKKACiiigAooooAKKKKACiiigAoo" +
  "ooAKKKKACiiigAooooAKKKKACiiigAooooAKKQkAEnoKg+3W//AD0/8dNAFiiq/wBut/8Anp/46aPt1v8A89P/AB00AWKKr/brf/np/wCOmj7db/8APT/x00AWKKii" +
  "uIpmIjbcQM9DUtABRRRQAUUUUAFFFFABRRRQAUUUUAFFFFABRRRQAUUUUANk/wBW30NYFb8n+rb6GsCmhMKKKKoQUUUUAXdL/wBc/wDu/wBa1Ky9L/1z/wC7/WtSpY" +
  "0FFFFIYUUUUAFFFFABRRRQAUVX+1f7H60fav8AY/WgCxRVf7V/sfrR9q/2P1oAsUVX+1f7H60fav8AY/WgCxRVf7V/sfrR9q/2P1oAmk/1bfQ1gVrvc5Rhs7etZFNC" +
  "YUUU0uB05piHUUA5HFFMC7pf+uf/AHf61qVkWEnlyscZytX/ALV/sfrUsaLFFV/tX+x+tH2r/Y/WkMsUVX+1f7H60fav9j9aALFFV/tX+x+tH2r/AGP1oAsUVX+1f7" +
  "H60fav9j9aAK9FFFABRRRQAUUUUAFFFITgZPAoAG+6fpWfmrrMSpI4XHU1R/lTQmIeaMUvvR2FMQnSnA0nf60Y7flQBYtfvn6VaqpaH94QeuKt0mNBRRRSGFFFFABR" +
  "RRQAUUUUAFFFFABRRRQAUUhIAyTgU35n9VX9TQApbBwBlvSmkAfNIc+gpSQgwo5PQDvSqvO5uW/lQAm0vy/4D0qJbdHOedvb3qVvnO0dP4j/AEp9AFc26FwOeBk80P" +
  "boMdeo71MnILf3uaH6D/eFFwImtk2nGc9uaBbxsoIzzU9NXhiv4igCKOJRkHO4df8AEVIGKnD/AIN60rqTgr94dKAQ69OD1BoAdRTMmPryvr6U+gAooooAKKKKACii" +
  "igAoopGYKOaAFppbnCjJ/QUmGfr8o9O9OAAGAMCgBAvOWOT/ACoZudq8t/KkLFjhPxPpTlUKMCgBFXbz1J6mh2PCr94/p70rNtGfyHrSKuOTyx60AKqhRgUj8jb/AH" +
  "uKdTRy5PpwKAHU1+g/3hTqa/Qf7woAdTX4Ib04P0p1IRkEHoaAFpjfKd46fxD+tKhyvPUcGnUAHUcUzBTlRlfT0+lA+Rsfwnp7Gn0AICGGQcilphUg7k69x605WDDj" +
  "8R6UALRRRQAUUUUAM3FuE59+1KqgHPU+poooAdTMmTpwvr60UUAOAAGAMCgnAyelFFADVBY7z+A9KfRRQAjHapPpQo2qB370UUALTX6D/eFFFADqKKKAG9H9m/n/AJ" +
  "/lTqKKAEIBBB6GmqSDtbr2PqKKKAH01lycg4b1oooAFbPBGGHUU6iigAooooA//9k=",
  "base64",
);

export class MockServer {
  /** isFree: the scale of the map is; out: where a scaled map may be written; images: of keyframes, "off", "some" or "none". */
  constructor({ world = "walk", skip = 0, token = "", isFree = false, out = "", images = "some" } = {}) {
    Object.assign(this, { isFree, out, images });
    this.token = token;
    this.kind = world;
    this.generation = 0;
    this.phase = world === "map" ? "map" : world === "empty" || world === "loading" ? "starting" : "running";
    this.doing = "";
    this.requests = [];
    this.calibration = [];
    this.imu = undefined;
    this.dots = random(11);
    this.reset();
    for (let i = 0; i < skip; ++i) this.world.step();
    this.server = createServer((request, response) => void this.serve(request, response));
    this.sockets = new WebSocketServer({ noServer: true });
    this.server.on("upgrade", (request, socket, head) => this.upgrade(request, socket, head));
  }

  reset() {
    ++this.generation;
    this.world = this.kind === "large" ? largeMap() : new Walk({ isSphere: this.kind === "sphere", isFree: this.isFree });
    if (this.kind === "empty" || this.kind === "loading") this.world.markers = [];
  }

  listen(port) {
    return new Promise((resolve) => {
      this.server.listen(port, "127.0.0.1", () => {
        if (this.kind === "large") this.ready = [...this.snapshot()];
        if (this.phase !== "starting") this.timer = setInterval(() => this.tick(), 100);
        resolve(this.server.address().port);
      });
    });
  }

  /** Nothing comes any more. */
  hold() {
    clearInterval(this.timer);
  }

  close() {
    clearInterval(this.timer);
    for (const socket of this.sockets.clients) socket.terminate();
    return new Promise((resolve) => this.server.close(resolve));
  }

  async serve(request, response) {
    const url = new URL(request.url, "http://mock");
    if (url.pathname === "/status") {
      response.writeHead(this.isAllowed(url) ? 200 : 403, { "content-type": "application/json" });
      return response.end(JSON.stringify(this.status()));
    }
    const path = normalize(url.pathname === "/" ? "/index.html" : url.pathname);
    const body = await readFile(DIST + path).catch(() => null);
    response.writeHead(body ? 200 : 404, { "content-type": TYPES[extname(path)] ?? "text/plain", "content-security-policy": POLICY });
    response.end(body ?? "not found");
  }

  isAllowed(url) {
    return this.token === "" || url.searchParams.get("token") === this.token;
  }

  upgrade(request, socket, head) {
    const url = new URL(request.url, "http://mock");
    if (url.pathname !== "/ws" || !this.isAllowed(url)) return socket.end("HTTP/1.1 403 Forbidden\r\n\r\n");
    this.sockets.handleUpgrade(request, socket, head, (client) => {
      client.on("message", (text) => this.answer(client, JSON.parse(text)));
      client.send(JSON.stringify(this.hello()));
      client.send(JSON.stringify(this.status()));
      for (const bytes of this.ready ?? this.snapshot()) client.send(bytes);
    });
  }

  hello() {
    const isLive = this.kind !== "map" && this.kind !== "loading";
    return {
      type: "hello", protocol: 1, program: "waymark mock", mode: isLive ? "live" : "map", input: isLive ? "courtyard" : "courtyard.wmap",
      setup: "stereo", timing: "realtime", controls: isLive ? ["pause", "resume", "reset", "save", "mapping", "stop"] : this.out ? ["scale"] : [],
      keyframe_images: this.images !== "off", stages: STAGES, states: STATES, reasons: REASONS,
    };
  }

  status() {
    const { world } = this;
    const last = world.frames.at(-1) ?? { frame: 0, time_s: 0, state: 0, reason: 0, tracking_ms: 0 };
    const t = last.tracking_ms;
    return {
      type: "status", phase: this.phase, doing: this.doing, is_mapping: world.isMapping, frame: last.frame, time_s: last.time_s,
      state: STATES[this.kind === "lost" ? 3 : last.state], reason: REASONS[this.kind === "lost" ? 3 : last.reason], submap: 0, matches: 412, inliers: 377,
      stages_ms: [0.45 * t, 0.2 * t, 0, 0.08 * t, 0.25 * t, 0, 0, 0.02 * t], tracking_ms: t, tracking_ms_median: 12.4,
      frames: world.frames.length, frames_total: 3682, tracked: world.frames.filter((each) => each.state === 1).length, unreadable: 0, dropped: 0,
      lost_count: 1, keyframes: world.keyframes.length, landmarks: world.landmarks.size, submaps: world.submaps.length, loops: world.loops.length,
      frames_per_s: 20, calibration: this.calibration, imu: this.imu, clients: this.sockets?.clients.size ?? 0,
    };
  }

  *snapshot() {
    const { world } = this;
    const landmarks = [...world.landmarks.values()].sort((a, b) => a.id - b.id);
    yield encode.begin(this.generation, [landmarks.length, world.keyframes.length, world.frames.length]);
    yield encode.submaps(world.submaps);
    yield encode.cameras(world.cameras);
    yield encode.keyframes(world.keyframes);
    yield encode.covisibility(world.covisibility);
    yield encode.loops(world.loops);
    for (let i = 0; i < world.frames.length; i += CHUNK) yield encode.trajectory(world.frames.slice(i, i + CHUNK));
    for (let i = 0; i < landmarks.length; i += CHUNK) yield encode.landmarks(landmarks.slice(i, i + CHUNK));
    const onEdges = landmarks.filter((each) => each.half);
    for (let i = 0; i < onEdges.length; i += CHUNK) yield encode.edgePoints(onEdges.slice(i, i + CHUNK));
    if (world.markers.length) yield encode.markers(world.markers);
    yield encode.end(this.generation);
  }

  /** Two frames, ten times per second. */
  tick() {
    if (this.kind === "large") this.tickLarge();
    else if (this.phase === "running" && this.kind !== "lost") for (let i = 0; i < 2; ++i) this.send(this.world.step());
    this.broadcast(JSON.stringify(this.status()));
    if (this.phase === "running") this.broadcast(this.frame());
  }

  /** As much as changes in a running session with a large map: local adjustment of some thousand landmarks. */
  tickLarge() {
    const { world } = this;
    const from = 20000 * Math.floor(20 * this.dots());
    const moved = Array.from({ length: 5000 }, (_, i) => world.landmarks.get(3 * (from + i)));
    this.broadcast(encode.landmarkPositions(moved));
    this.broadcast(encode.keyframePoses(world.keyframes.slice(-30)));
    this.broadcast(encode.covisibility(world.covisibility.slice(-5)));
    const { position, rotation } = world.keyframes.at(-1);
    const frame = world.frames.at(-1).frame + 2;
    const entry = { frame, time_s: frame / 20, position, rotation, tracking_ms: 12, submap: 0, state: 1, reason: 0 };
    world.frames.push(entry);
    this.broadcast(encode.trajectory([entry]));
  }

  frame() {
    const last = this.world.frames.at(-1);
    const pixels = Array.from({ length: 700 }, () => [752 * this.dots(), 480 * this.dots() ** 0.8]);
    const states = pixels.map(() => (this.dots() < 0.55 ? 1 : 0));
    return encode.frame({ frame: last?.frame ?? 0, time_s: last?.time_s ?? 0, width_px: 752, height_px: 480, pixels, states });
  }

  send({ frames, keyframes, landmarks, erased, covisibility, loops }) {
    if (keyframes.length) this.broadcast(encode.keyframes(keyframes));
    if (covisibility.length) this.broadcast(encode.covisibility(covisibility));
    if (loops) this.broadcast(encode.loops(this.world.loops));
    if (landmarks.length) this.broadcast(encode.landmarks([...new Set(landmarks)].sort((a, b) => a.id - b.id)));
    const onEdges = [...new Set(landmarks)].filter((each) => each.half).sort((a, b) => a.id - b.id);
    if (onEdges.length) this.broadcast(encode.edgePoints(onEdges));
    if (erased.length) this.broadcast(encode.landmarksErased(erased));
    this.broadcast(encode.trajectory(frames));
  }

  broadcast(data) {
    for (const client of this.sockets.clients) client.send(data);
  }

  answer(client, request) {
    this.requests.push(request);
    const { world } = this;
    const reply = (more) => client.send(JSON.stringify({ type: "reply", request: request.request, ok: true, ...more }));
    const acts = {
      pause: () => (this.phase = "paused"),
      resume: () => (this.phase = "running"),
      stop: () => (this.phase = "done"),
      mapping: () => (world.isMapping = request.on),
      reset: () => {
        this.reset();
        for (const bytes of this.snapshot()) this.broadcast(bytes);
      },
      save: () => ({ path: "courtyard.wmap" }),
      scale: () => ({ path: this.out }),
    };
    if (acts[request.do]) {
      const more = acts[request.do]();
      return reply(typeof more === "object" ? more : {});
    }
    if (request.do === "image") {
      const image = this.image(request);
      return image ? client.send(image) : reply({ ok: false, error: "its image was not kept" });
    }
    const element = request.do === "keyframe" ? this.keyframe(request.id) : request.do === "landmark" ? this.landmark(request.id) : null;
    if (element) client.send(JSON.stringify({ type: request.do, request: request.request, ...element }));
    else reply({ ok: false, error: `no such ${request.do}` });
  }

  keyframe(id) {
    const keyframe = this.world.keyframes[id];
    if (!keyframe) return null;
    const landmarks = [...this.world.landmarks.values()].filter((each) => each.seen.includes(id)).map((each) => each.id);
    return {
      id, frame: keyframe.frame, timestamp_ns: "1403636579763555584", submap: 0, position: keyframe.position, rotation: keyframe.rotation,
      parent: id > 0 ? id - 1 : null, features: 1000, camera: "pinhole, 752x480 px", covisible: this.world.covisibility[id].edges, landmarks,
    };
  }

  image({ request, id }) {
    if (!this.world.keyframes[id] || this.images !== "some") return null;
    const pixels = Array.from({ length: 300 }, () => [752 * this.dots(), 480 * this.dots()]);
    const states = pixels.map((_, i) => i % 4);
    return encode.keyframeImage({ request, keyframe: id, width_px: 752, height_px: 480, pixels, states, jpeg: JPEG });
  }

  landmark(id) {
    const landmark = this.world.landmarks.get(id);
    if (!landmark) return null;
    const observations = landmark.seen.map((keyframe, i) => ({ keyframe, pixel: [100.5 + 31 * i, 50.25 + 4 * i], camera: 0, error_px: 0.4 + 0.1 * i }));
    return { id, submap: 0, position: landmark.position, reference: landmark.seen[0], num_visible: 40, num_found: 37, observations };
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { values } = parseArgs({
    options: { port: { type: "string", default: "8080" }, world: { type: "string" }, skip: { type: "string", default: "0" }, token: { type: "string" } },
  });
  const port = await new MockServer({ ...values, skip: Number(values.skip) }).listen(Number(values.port));
  console.log(`http://127.0.0.1:${port}/${values.token ? `?token=${values.token}` : ""}`);
}
