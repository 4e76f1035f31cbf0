// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

/** The element of index.html with this id. */
export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`no element '${id}'`);
  return element as T;
}

type Attributes = Record<string, string | boolean | ((event: Event) => void)>;

/** A new element; functions among the attributes are listeners. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (typeof value === "string") element.setAttribute(name, value);
    else element.toggleAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** Sets a text, only where it is another one: the page is not laid out anew for nothing. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A row of words of which one is chosen. */
export class Choice<T extends string> {
  private readonly buttons = new Map<T, HTMLButtonElement>();

  constructor(host: HTMLElement, items: readonly (readonly [T, string])[], choose: (value: T) => void) {
    for (const [value, word] of items) {
      const button = make("button", { role: "radio", "data-value": value, click: () => choose(value) }, word);
      this.buttons.set(value, button);
      host.append(button);
    }
  }

  set(value: T): void {
    for (const [each, button] of this.buttons) button.setAttribute("aria-checked", String(each === value));
  }
}

/** With a capital letter. */
export function sentence(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

const numbers = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** 12345 as "12 345", with narrow spaces. */
export function grouped(value: number): string {
  return numbers.format(value).replaceAll(",", "\u202f");
}

/** How many of something there are: "1 keyframe", "2 keyframes". */
export function countOf(count: number, noun: string): string {
  return `${grouped(count)} ${noun}${count === 1 ? "" : "s"}`;
}

/** Seconds as "1:02.5" or "1:02:03". */
export function clock(time_s: number, withTenths = true): string {
  const tenths = Math.round(10 * time_s);
  const s = Math.floor(tenths / 10);
  const two = (value: number) => String(value).padStart(2, "0");
  if (s >= 3600) return `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
  return `${Math.floor(s / 60)}:${two(s % 60)}${withTenths ? `.${tenths % 10}` : ""}`;
}

const ICONS = {
  play: "M6 3.5v13l10-6.5z",
  pause: "M6.5 4v12M13.5 4v12",
  fit: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4M8 10h4M10 8v4",
  camera: "M3 6.5h3.2L7.5 4h5l1.3 2.5H17v9.5H3zM10 14a3 3 0 1 0 0-6 3 3 0 0 0 0 6z",
  theme: "M10 3a7 7 0 1 0 0 14zM10 3a7 7 0 0 1 0 14",
  measure: "M3 13.5L13.5 3 17 6.5 6.5 17zM6 10.5l1.8 1.8M8.6 7.9l1.8 1.8M11.2 5.3l1.8 1.8",
  close: "M5 5l10 10M15 5L5 15",
};

export function setIcon(element: HTMLElement, name: keyof typeof ICONS): void {
  if (element.dataset["icon"] === name) return;
  element.dataset["icon"] = name;
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", ICONS[name]);
  svg.append(path);
  element.replaceChildren(svg);
}
