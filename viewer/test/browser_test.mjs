// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

// The page in a real browser, first with the mock server, then with the program.
//
// usage: node test/browser_test.mjs [--waymark PROGRAM --input SEQUENCE] [--pictures FOLDER] [--only NAME]
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { parseArgs } from "node:util";
import { launch } from "./chromium.mjs";
import { mockCases } from "./mock_cases.mjs";
import { programCases } from "./program_cases.mjs";

const { values } = parseArgs({
  options: {
    waymark: { type: "string" }, input: { type: "string" }, pictures: { type: "string", default: "../build/viewer/pictures" },
    only: { type: "string" },
  },
});
mkdirSync(values.pictures, { recursive: true });

const all = values.waymark ? [...mockCases, ...programCases] : mockCases;
const cases = all.filter((run) => !values.only || values.only === run.name);
let failed = 0;
for (const run of cases) {
  const start = performance.now();
  const browser = await launch();
  const context = { browser, pictures: values.pictures, waymark: values.waymark, input: values.input, cleanUp: [] };
  try {
    await run(context);
    console.log(`ok      ${run.name} (${((performance.now() - start) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    const text = error instanceof assert.AssertionError ? error.message : error.stack;
    console.log(`FAILED  ${run.name}\n${text.slice(0, 1500)}`);
  }
  await browser.close();
  for (const act of context.cleanUp.reverse()) await act();
}
console.log(`${cases.length - failed} passed, ${failed} failed`);
process.exit(failed > 0 ? 1 : 0);
