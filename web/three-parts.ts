import { existsSync, readFileSync, realpathSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";

const THREE = realpathSync(join(dirname(fileURLToPath(import.meta.url)), "node_modules/three/src"));
const SHADERS = join(THREE, "renderers/shaders");

/** The materials in src/scene, with the names of their shaders. */
export const MATERIALS: Readonly<Record<string, string>> = {
  LineBasicMaterial: "meshbasic",
  LineDashedMaterial: "linedashed",
  MeshLambertMaterial: "meshlambert",
  SpriteMaterial: "sprite",
};

/** Modules of the renderer that the 3D view does not need: virtual reality, shadows, maps of the surroundings, other buffers. */
const REPLACED: Record<string, string> = {
  "renderers/webxr/WebXRManager.js": `export class WebXRManager {
    enabled = false;
    isPresenting = false;
    addEventListener() {}
    removeEventListener() {}
    setAnimationLoop() {}
    getEnvironmentBlendMode() {}
    dispose() {}
  }`,
  "renderers/webgl/WebGLShadowMap.js": "export function WebGLShadowMap() { this.enabled = false; this.render = () => {}; }",
  "renderers/webgl/WebGLEnvironments.js": "export function WebGLEnvironments() { return { get: (texture) => texture, dispose() {} }; }",
  "renderers/webgl/WebGLOutput.js": "export class WebGLOutput {}",
  "renderers/shaders/DFGLUTData.js": "export function getDFGLUT() { return null; }",
  "extras/PMREMGenerator.js": "export class PMREMGenerator {}",
};

/** Returns the names of all parts of shaders that the materials and the renderer include. */
function included(): Set<string> {
  const found = new Set<string>();
  const open = [...Object.values(MATERIALS).map((name) => join(SHADERS, `ShaderLib/${name}.glsl.js`)), join(THREE, "renderers/webgl/WebGLProgram.js")];
  for (let file = open.pop(); file !== undefined; file = open.pop()) {
    for (const [, quoted, included] of readFileSync(file, "utf-8").matchAll(/ShaderChunk\[ '(\w+)' \]|#include <(\w+)>/g)) {
      const name = quoted ?? included ?? "";
      const part = join(SHADERS, `ShaderChunk/${name}.glsl.js`);
      if (found.has(name) || !existsSync(part)) continue;
      found.add(name);
      open.push(part);
    }
  }
  return found;
}

/** Returns the source of a module with its shaders stripped of comments and indentation. */
function stripped(source: string): string {
  return source.replace(/\/\* glsl \*\/\s*`([^`]*)`/g, (_, shader: string) => {
    const text = shader.replace(/\/\*[^]*?\*\/|\/\/.*$/gm, "").replace(/^\s+|[ \t]+$/gm, "");
    return `\`${text.replace(/\n{2,}/g, "\n")}\``;
  });
}

/**
 * Bundles three.js from its sources, without the shaders and modules that the 3D view does not use: a fifth of it. Objects
 * of a material that is not in `MATERIALS` are not drawn; a test compares them with src/scene.
 */
export function threeParts(): Plugin {
  let needed = new Set<string>();
  const missing = new Set(Object.keys(REPLACED));
  return {
    name: "three-parts",
    apply: "build",
    enforce: "pre",
    config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: join(THREE, "Three.js") }] } }),
    buildStart() {
      needed = included();
    },
    load(id) {
      if (!id.startsWith(THREE)) return undefined;
      const name = id.slice(THREE.length + 1);
      missing.delete(name);
      if (name in REPLACED) return REPLACED[name];
      const [, folder, shader = ""] = /^renderers\/shaders\/(ShaderChunk|ShaderLib)\/(\w+)\.glsl\.js$/.exec(name) ?? [];
      if (folder === "ShaderChunk" && !needed.has(shader)) return "export default '';";
      if (folder === "ShaderLib" && !Object.values(MATERIALS).includes(shader)) return "export const vertex = '', fragment = '';";
      return folder === undefined ? undefined : stripped(readFileSync(id, "utf-8"));
    },
    buildEnd(failure) {
      if (failure === undefined && missing.size > 0) this.error(`three.js has no ${[...missing].join(", ")}`);
    },
  };
}
