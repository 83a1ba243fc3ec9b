import { shallowRef, watch } from "vue";
import { ask } from "../api/ask.ts";
import { connection, events } from "./robot.ts";
import { status } from "./can.ts";

/** The places of the parts by name [m]: on the twin's table, read again after each step. */
export const table = shallowRef<Record<string, readonly number[] | null>>({});

watch(
  [connection, status, () => events.value.at(-1)?.kind === "step" && events.value.at(-1)?.seq],
  async () => {
    if (connection.value !== "live" || status.value?.address !== "sim") return;
    const found = await ask("GET /v1/twin").catch(() => null);
    if (found !== null) table.value = found.parts;
  },
);
