import { shallowRef } from "vue";
import { ask } from "../api/ask.ts";
import type { Config } from "../generated/api.ts";
import { whenLive } from "./load.ts";
import { restarts } from "./robot.ts";

/** The configuration in force, null until it is known. It changes only when the service starts again. */
export const configuration = shallowRef<Config | null>(null);

whenLive(async () => {
  configuration.value = await ask("GET /v1/config").catch(() => configuration.value);
}, [restarts]);
