import { createRequire } from "node:module";
import vue from "@vitejs/plugin-vue";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { ICONS } from "./src/look/icon-names.ts";

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

export default defineConfig({
  base: "./",
  plugins: [vue(), icons()],
  build: {
    outDir: "../src/maya_un/dashboard/site",
    emptyOutDir: true,
    assetsInlineLimit: 0, // the content security policy allows no data: scripts, styles or fonts
    modulePreload: { polyfill: false }, // it would be an inline script
    target: "es2022",
    chunkSizeWarningLimit: 800, // three.js, which is loaded after the first paint
  },
  server: {
    proxy: { "/v1": { target: "http://127.0.0.1:4133", ws: true } },
  },
  test: { environment: "node", include: ["test/**/*.test.ts"] },
});
