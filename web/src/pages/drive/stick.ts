import type { Vector } from "../../parts/hold.ts";

/** A stick within this share of its way is at rest: no stick returns exactly to its middle. */
export const DEAD = 0.15;

/** The least share of the full speed. */
export const SLOWEST = 0.02;

/** Returns a deflection (right and up positive) with its length limited to 1. */
export function deflection(right: number, up: number): [right: number, up: number] {
  const length = Math.hypot(right, up);
  return length > 1 ? [right / length, up / length] : [right, up];
}

/** Returns the share of the full speed for a share of the way: none in the dead zone, then finer near it. */
export function shaped(way: number): number {
  const beyond = (Math.min(1, Math.abs(way)) - DEAD) / (1 - DEAD);
  return beyond <= 0 ? 0 : Math.sign(way) * Math.max(SLOWEST, beyond ** 1.6);
}

/**
 * Returns the vector for a stick in x and y and another one in z, null for rest. Each is shaped by its own way, so the
 * direction in the plane stays that of the stick.
 */
export function vectorOf(plane: readonly [number, number], height: number): Vector | null {
  const [x, y] = deflection(...plane);
  const length = Math.hypot(x, y);
  const share = shaped(length);
  const found: Vector = [share && (x / length) * share, share && (y / length) * share, shaped(height)];
  return limited(found);
}

/** Returns a vector with its length limited to 1, null for rest. */
export function limited([x, y, z]: Vector): Vector | null {
  const length = Math.hypot(x, y, z);
  if (length === 0) return null;
  return length > 1 ? [x / length, y / length, z / length] : [x, y, z];
}
