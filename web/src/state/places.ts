import { ref, shallowRef, type Ref } from "vue";
import { ask } from "../api/ask.ts";
import type { PalletInfo, Point, TaughtPose, WorkspaceShape } from "../generated/api.ts";
import type { Zone } from "../machine/plan.ts";
import { useLoaded, whenLive } from "./load.ts";
import { latestEvent, state } from "./robot.ts";

/** Taught poses and pallets, and the zones to keep out of. Pages that change them call `readPlaces`. */
export const poses = shallowRef<readonly TaughtPose[]>([]);
export const pallets = shallowRef<readonly PalletInfo[]>([]);
export const zones = shallowRef<readonly Zone[]>([]);

/** More poses than these lie so close in a picture that their names cover each other. */
export const MOST_NAMES = 24;

/** Whether the places have been read since the page was loaded. */
export const placesKnown = ref(false);

/** Reads poses, pallets and zones again. */
export async function readPlaces(): Promise<void> {
  const [taught, grids, forbidden] = await Promise.all([ask("GET /v1/poses"), ask("GET /v1/pallets"), ask("GET /v1/zones")]);
  poses.value = taught;
  pallets.value = grids;
  zones.value = forbidden;
  placesKnown.value = true;
}

/** Returns the place of a cell of a pallet, counted from 1 [m]; null without a valid grid. */
export function cellOf(pallet: Pick<PalletInfo, "rows" | "columns" | "corners">, row: number, column: number): Point | null {
  if (pallet.corners === null || pallet.corners.length < 4) return null;
  const along = pallet.columns > 1 ? (column - 1) / (pallet.columns - 1) : 0;
  const down = pallet.rows > 1 ? (row - 1) / (pallet.rows - 1) : 0;
  const [first, right, lower, last] = pallet.corners as [Point, Point, Point, Point];
  return first.map((value, i) => {
    const upper = value + along * ((right[i] ?? 0) - value);
    const bottom = (lower[i] ?? 0) + along * ((last[i] ?? 0) - (lower[i] ?? 0));
    return upper + down * (bottom - upper);
  }) as Point;
}

/** Reads the places while the caller is shown: at once, on each new connection, and when places or zones change. */
export function usePlaces(): void {
  whenLive(() => readPlaces().catch(() => undefined), [latestEvent({ kind: "zones" }), latestEvent({ kind: "places" })]);
}

/**
 * The shape of the workspace with its rings at a height [m], null until it is known. It is read again when the height
 * changes or the robot is homed.
 */
export function useWorkspace(height: () => number | undefined): Ref<WorkspaceShape | null> {
  return useLoaded(() => ask("GET /v1/workspace", { query: { z: height() } }), [height, () => state.value?.homed]).value;
}
