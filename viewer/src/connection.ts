// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { KeyframeImage } from "./protocol";
import type { Answer, Hello, Status, TextMessage } from "./text_messages";

export type ConnectionState = "connecting" | "open" | "waiting" | "refused";

export interface Listener {
  onState(state: ConnectionState, retryAt_ms: number): void;
  onHello(hello: Hello): void;
  onStatus(status: Status): void;
  onBinary(data: ArrayBuffer): void;
}

const FIRST_PAUSE_MS = 500;
const LONGEST_PAUSE_MS = 5000;

/** The WebSocket to the program. Connects again by itself, with growing pauses. */
export class Connection {
  private socket: WebSocket | null = null;
  private pause_ms = FIRST_PAUSE_MS;
  private timer = 0;
  private nextRequest = 1;
  private readonly pending = new Map<number, (answer: Answer | null) => void>();

  constructor(private readonly listener: Listener) {}

  connect(): void {
    clearTimeout(this.timer);
    this.listener.onState("connecting", 0);
    const socket = new WebSocket(addressOf("/ws", location.protocol === "https:" ? "wss:" : "ws:"));
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      if (typeof event.data === "string") this.takeText(event.data);
      else this.listener.onBinary(event.data);
    };
    socket.onopen = () => this.listener.onState("open", 0);
    socket.onclose = () => this.closed();
    this.socket = socket;
  }

  /** Sends a request; resolves with its answer, or with null when the connection closes before. */
  request(action: string, more: Record<string, unknown> = {}): Promise<Answer | null> {
    const socket = this.socket;
    if (!socket || socket.readyState !== WebSocket.OPEN) return Promise.resolve(null);
    const request = this.nextRequest++;
    socket.send(JSON.stringify({ request, do: action, ...more }));
    return new Promise((resolve) => this.pending.set(request, resolve));
  }

  private takeText(text: string): void {
    const message = JSON.parse(text) as TextMessage;
    if (message.type === "hello") {
      this.pause_ms = FIRST_PAUSE_MS;
      this.listener.onHello(message);
    } else if (message.type === "status") {
      this.listener.onStatus(message);
    } else if (message.request !== null) {
      this.settle(message.request, message);
    }
  }

  /** An answer that came as a binary message. */
  takeImage(image: KeyframeImage): void {
    this.settle(image.request, { type: "image", ...image });
  }

  private settle(request: number, answer: Answer): void {
    this.pending.get(request)?.(answer);
    this.pending.delete(request);
  }

  private closed(): void {
    this.socket = null;
    for (const resolve of this.pending.values()) resolve(null);
    this.pending.clear();
    this.listener.onState("waiting", performance.now() + this.pause_ms);
    this.timer = window.setTimeout(() => void this.retry(), this.pause_ms);
    this.pause_ms = Math.min(LONGEST_PAUSE_MS, this.pause_ms * 1.6);
  }

  /** A browser does not say why a WebSocket was refused; /status does. */
  private async retry(): Promise<void> {
    const status = await fetch(addressOf("/status", location.protocol)).then((r) => r.status, () => 0);
    if (status === 403) {
      this.listener.onState("refused", 0);
      this.timer = window.setTimeout(() => void this.retry(), LONGEST_PAUSE_MS);
    } else {
      this.connect();
    }
  }
}

function addressOf(path: string, protocol: string): string {
  const token = new URLSearchParams(location.search).get("token");
  return `${protocol}//${location.host}${path}${token ? `?token=${encodeURIComponent(token)}` : ""}`;
}
