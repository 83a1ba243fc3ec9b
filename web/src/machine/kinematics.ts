import type { Geometry, Point } from "../generated/api.ts";

/** Returns the point where the lines meet for joints (rad, m, m) [m]; null if they cannot meet. */
export function meeting(geometry: Geometry, a: number, b: number, c: number): Point | null {
  const { height, delta, length } = geometry;
  const width = length - delta;
  const u = width / 2 + ((b - c) * (b + c)) / (2 * width);
  const square = (b - u) * (b + u);
  if (square < 0) return null;
  const d = delta + u;
  return [d * Math.sin(a), d * Math.cos(a), height - Math.sqrt(square)];
}

/** Returns the gripper point of joints (rad, m, m) [m]; null if the lines cannot meet. */
export function gripperAt(geometry: Geometry, joints: readonly [number, number, number]): Point | null {
  const met = meeting(geometry, ...joints);
  return met && [met[0], met[1], met[2] - geometry.gripper_height];
}

/** Returns joints (rad, m, m) that hold the gripper at a point [m], whether the robot reaches it or not; a is -π to π. */
export function jointsFor(geometry: Geometry, [x, y, z]: Point): [a: number, b: number, c: number] {
  const { height, delta, length, gripper_height } = geometry;
  const depth = height - gripper_height - z;
  const d = Math.hypot(x, y);
  return [Math.atan2(x, y), Math.hypot(depth, d - delta), Math.hypot(depth, length - d)];
}
