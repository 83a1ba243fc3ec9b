import type { Vector } from "../../parts/hold.ts";
import { limited } from "./stick.ts";

/** The keys that drive, with their directions. */
export const DRIVING: Readonly<Record<string, Vector>> = {
  ArrowRight: [1, 0, 0],
  ArrowLeft: [-1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

/** With Shift the robot jogs at this share of the speed. */
export const SLOW = 0.25;

/** Returns the vector of the held keys, null if they cancel each other. */
export function vectorOfKeys(held: Iterable<string>, slow: boolean): Vector | null {
  const sum: [number, number, number] = [0, 0, 0];
  for (const key of held) DRIVING[key]?.forEach((share, i) => (sum[i as 0] += share));
  const full = limited(sum);
  if (full === null || !slow) return full;
  return [full[0] * SLOW, full[1] * SLOW, full[2] * SLOW];
}
