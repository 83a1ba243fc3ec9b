import { shallowRef, watch } from "vue";
import { ask } from "../api/ask.ts";
import type { Config } from "../generated/api.ts";
import { connection, restarts } from "./robot.ts";

/** The configuration in force. It changes only when the service starts again. */
export const configuration = shallowRef<Config | null>(null);

let started = false;

/** Reads the configuration now, and again after each restart of the service. */
export function useConfiguration(): typeof configuration {
  if (!started) {
    started = true;
    watch(
      [connection, restarts],
      async () => {
        if (connection.value !== "live") return;
        configuration.value = await ask("GET /v1/config").catch(() => configuration.value);
      },
      { immediate: true },
    );
  }
  return configuration;
}
