import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, join } from "node:path";
import { brotliCompressSync } from "node:zlib";
import vue from "@vitejs/plugin-vue";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { ICONS } from "./src/look/icon-names.ts";
import { threeParts } from "./three-parts.ts";

type Shape = [tag: string, attributes: Record<string, string>];

/** Serves the shapes of the icons that the dashboard uses as the module `virtual:icons`. */
function icons(): Plugin {
  const all = createRequire(import.meta.url)("lucide-static/icon-nodes.json") as Record<string, Shape[]>;
  return {
    name: "icons",
    resolveId: (id) => (id === "virtual:icons" ? "\0virtual:icons" : undefined),
    load(id) {
      if (id !== "\0virtual:icons") return undefined;
      const used = ICONS.map((name) => {
        const shapes = all[name];
        if (shapes === undefined) throw new Error(`lucide has no icon ${name}`);
        return [name, shapes];
      });
      return `export default ${JSON.stringify(Object.fromEntries(used))}`;
    },
  };
}

const WORKER = "worker.js";

/** Tells the service worker which files belong to this build, and gives the build a name that follows from them. */
function files(): Plugin {
  return {
    name: "files",
    apply: "build",
    generateBundle: {
      order: "post",
      handler(_, bundle) {
        const made = Object.values(bundle).filter((one) => one.fileName !== WORKER);
        const content = new Map(made.map((one) => [one.fileName, one.type === "chunk" ? one.code : one.source]));
        for (const name of readdirSync("public")) content.set(name, readFileSync(`public/${name}`));
        const names = [...content.keys()].sort();
        const hash = createHash("sha256");
        for (const name of names) hash.update(name).update(content.get(name) ?? "");
        const kept = names.map((name) => (name === "index.html" ? "/" : `/${name}`));
        const worker = bundle[WORKER];
        if (worker?.type !== "chunk") throw new Error("there is no service worker in the bundle");
        const before = `const FILES=${JSON.stringify(kept)},BUILD=${JSON.stringify(hash.digest("hex").slice(0, 16))};`;
        worker.code = before + worker.code;
      },
    },
  };
}

/** Kinds of files that are not compressed already. */
const COMPRESSIBLE = /\.(css|html|js|svg|webmanifest)$/;

/** Writes a brotli file beside each file of the site: the service has no brotli of its own (dashboard/pages.py). */
function brotli(): Plugin {
  return {
    name: "brotli",
    apply: "build",
    writeBundle: {
      order: "post",
      handler({ dir = "" }) {
        for (const file of readdirSync(dir, { withFileTypes: true, recursive: true })) {
          const path = join(file.parentPath, file.name);
          if (file.isFile() && COMPRESSIBLE.test(path)) writeFileSync(`${path}.br`, brotliCompressSync(readFileSync(path)));
        }
      },
    },
  };
}

const components = new Map<string, string>();

/** Returns the mark of a component's scoped styles: its name, which compresses better than the usual hash. */
function scopeOf(path: string): string {
  const name = basename(path, ".vue").toLowerCase(); // as the browser writes attributes
  if ((components.get(name) ?? path) !== path) throw new Error(`${path} and ${components.get(name)} have the same name`);
  components.set(name, path);
  return name;
}

export default defineConfig({
  base: "./",
  plugins: [vue({ features: { componentIdGenerator: scopeOf } }), icons(), threeParts(), files(), brotli()],
  define: {
    // parts of Vue that this page does not use
    __VUE_OPTIONS_API__: "false",
    __VUE_PROD_DEVTOOLS__: "false",
    __VUE_PROD_HYDRATION_MISMATCH_DETAILS__: "false",
  },
  build: {
    outDir: "../src/maya_un/dashboard/site",
    emptyOutDir: true,
    assetsInlineLimit: 0, // the content security policy allows no data: scripts, styles or fonts
    cssCodeSplit: false, // one file of 11 kB; in one for each part the styles have 17 kB, compressed
    modulePreload: { polyfill: false }, // it would be an inline script
    target: "es2022",
    chunkSizeWarningLimit: 800, // three.js, which is loaded after the first paint
    rolldownOptions: {
      input: { index: "index.html", worker: "src/app/worker.ts" },
      output: { entryFileNames: (chunk) => (chunk.name === "worker" ? WORKER : "assets/[name]-[hash].js") }, // its scope is its folder
    },
  },
  server: {
    proxy: { "/v1": { target: "http://127.0.0.1:4133", ws: true } },
  },
  test: { environment: "node", include: ["test/**/*.test.ts"], isolate: false }, // the files share nothing but an empty localStorage
});
