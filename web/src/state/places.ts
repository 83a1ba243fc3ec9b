import { ref, shallowRef, watch } from "vue";
import { ask } from "../api/ask.ts";
import type { PalletInfo, TaughtPose } from "../generated/api.ts";
import { connection } from "./robot.ts";

/** The taught places, which jobs may name. Teaching is no event, so `readPlaces` reads them again. */
export const poses = shallowRef<readonly TaughtPose[]>([]);
export const pallets = shallowRef<readonly PalletInfo[]>([]);

const wanted = ref(false);

export async function readPlaces(): Promise<void> {
  wanted.value = true;
  try {
    [poses.value, pallets.value] = await Promise.all([ask("GET /v1/poses"), ask("GET /v1/pallets")]);
  } catch {
    // without a connection the next one reads them
  }
}

watch(connection, () => wanted.value && connection.value === "live" && void readPlaces());
