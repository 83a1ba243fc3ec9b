import type { Geometry } from "../generated/api.ts";

/** Returns the point where the lines meet for joints (rad, m, m) [m]; null if they cannot meet. */
export function meeting(geometry: Geometry, a: number, b: number, c: number): [x: number, y: number, z: number] | null {
  const { height, delta, length } = geometry;
  const width = length - delta;
  const u = width / 2 + ((b - c) * (b + c)) / (2 * width);
  const square = (b - u) * (b + u);
  if (square < 0) return null;
  const d = delta + u;
  return [d * Math.sin(a), d * Math.cos(a), height - Math.sqrt(square)];
}
