// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { defineConfig } from "vitest/config";

// Fixed names, no hashes: the bundle is a part of the repository and is compared with what the sources build to.
export default defineConfig({
  base: "./",
  plugins: [
    {
      name: "licenses",
      generateBundle() {
        const license = readFileSync("node_modules/three/LICENSE", "utf8");
        this.emitFile({ type: "asset", fileName: "licenses.txt", source: `three.js, https://threejs.org\n\n${license}` });
      },
    },
  ],
  build: {
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 1000,
    rolldownOptions: {
      output: {
        entryFileNames: "waymark.js",
        chunkFileNames: "[name].js",
        assetFileNames: "[name][extname]",
      },
    },
  },
  server: { proxy: { "/ws": { target: "ws://127.0.0.1:8080", ws: true }, "/status": "http://127.0.0.1:8080" } },
  test: { include: ["test/*.test.ts"] },
});
