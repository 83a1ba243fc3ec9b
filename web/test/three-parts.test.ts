import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import { MATERIALS } from "../three-parts.ts";

const SCENE = join(import.meta.dirname, "..", "src", "scene");
const scene = readdirSync(SCENE).map((name) => readFileSync(join(SCENE, name), "utf-8")).join("\n");

it("bundles the shaders of all materials of the 3D view, and no others", () => {
  const used = new Set([...scene.matchAll(/new THREE\.(\w+Material)\(/g)].map((found) => found[1]));
  expect([...used].sort()).toEqual(Object.keys(MATERIALS));
});

it("leaves out only what the 3D view does not use", () => {
  expect(scene).not.toMatch(/Shadow|\.xr\b|\.environment\b|envMap|PMREM|outputBufferType/);
});
