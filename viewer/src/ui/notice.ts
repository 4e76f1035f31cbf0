// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { ConnectionState } from "../connection";
import type { Store } from "../store/store";
import type { Hello, Status } from "../text_messages";
import { byId, grouped, sentence, setText } from "./dom";
import { ADVICE, isOver, REASON_WORDS } from "./words";

type Words = { title: string; text: string; isStill?: boolean };

/** What there is to say something about. */
export interface Situation {
  connection: ConnectionState;
  retryIn_s: number;
  hello: Hello | null;
  status: Status | null;
  /** Whether the browser has WebGL. */
  canDraw: boolean;
}

const NO_WEBGL: Words = {
  title: "This browser offers no WebGL",
  text: "The map cannot be drawn; all else works. Switch on hardware acceleration in its settings, or open the page in another browser.",
  isStill: true,
};

/** What to say where the map would be, as long as there is none; and a line above it when something is wrong. */
export class Notice {
  show({ connection, retryIn_s, hello, status, canDraw }: Situation, store: Store): void {
    const hasMap = store.landmarks.count > 0 || store.keyframes.count > 0;
    const problem = connection === "open" || isOver(status) ? null : problemOf(connection, retryIn_s);
    const missing = hasMap ? null : (problem ?? waiting(hello, status));
    const notice = store.isLoading ? loading(store) : canDraw || (problem && !hasMap) ? missing : NO_WEBGL;
    const host = byId("notice");
    host.toggleAttribute("data-on", notice !== null);
    host.toggleAttribute("data-still", notice?.isStill ?? false);
    if (notice) {
      setText(byId("notice-title"), notice.title);
      setText(byId("notice-text"), notice.text);
    }
    const banner = hasMap ? (problem ? `${problem.title}. ${problem.text}` : lost(status)) : null;
    byId("banner").hidden = banner === null;
    setText(byId("banner"), banner ?? "");
  }
}

function problemOf(connection: ConnectionState, retryIn_s: number): Words {
  if (connection === "connecting") return { title: "Connecting", text: `to ${location.host}` };
  if (connection === "refused") {
    return { title: "This address needs its token", text: "Open the page with the whole address that the program printed.", isStill: true };
  }
  const when = retryIn_s >= 1 ? `Trying again in ${Math.round(retryIn_s)} s.` : "Trying again.";
  return { title: "No connection", text: `The program at ${location.host} does not answer. ${when}` };
}

function loading(store: Store): Words {
  const { expectedLandmarks, landmarks } = store;
  return { title: "Reading the map", text: expectedLandmarks > 0 ? `${grouped(landmarks.count)} of ${grouped(expectedLandmarks)} landmarks` : "" };
}

function waiting(hello: Hello | null, status: Status | null): Words {
  if (hello?.mode === "map" && status?.phase === "starting") return { title: "Loading the map", text: "The program prepares it to be shown." };
  if (status?.phase === "starting" && status.doing) return { title: "Before the first image", text: `${sentence(status.doing)}.` };
  if (!status || status.phase === "starting") return { title: "Waiting for the first image", text: "The map grows here as soon as there are images." };
  if (status.phase === "map" || isOver(status)) return { title: "An empty map", text: "It holds neither keyframes nor landmarks.", isStill: true };
  return { title: "Finding a start", text: ADVICE[status.reason] ?? ADVICE["none"]! };
}

function lost(status: Status | null): string | null {
  if (status?.phase !== "running" || status.state !== "lost") return null;
  const reason = REASON_WORDS[status.reason] ?? status.reason;
  return `Lost${reason ? `: ${reason}` : ""}. Go back to where the camera has been; until then a new part grows.`;
}
