// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { CalibrationChange } from "../text_messages";
import { byId, make } from "./dom";

/** The numbers of the calibration that the images changed, each with its standard deviation. */
export class CalibrationPanel {
  private readonly list = byId("calibration-list");
  private shown = "";

  show(changes: CalibrationChange[]): void {
    const text = JSON.stringify(changes);
    if (text === this.shown) return;
    this.shown = text;
    byId("calibration").hidden = changes.length === 0;
    const head = make("tr", {}, ...["", "given", "now", "±"].map((word) => make("th", {}, word)));
    this.list.replaceChildren(head, ...changes.map(row));
  }
}

/** With two digits of the standard deviation; angles in mrad. */
function row({ name, given, change, sigma }: CalibrationChange): HTMLElement {
  const isAngle = /\.(turn|baseline)_/.test(name);
  const factor = isAngle ? 1e3 : 1;
  const digits = Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(factor * sigma))));
  const numbers = [given, given + change, sigma].map((value) => make("td", {}, (factor * value).toFixed(digits)));
  return make("tr", {}, make("th", {}, isAngle ? `${name}, mrad` : name), ...numbers);
}
