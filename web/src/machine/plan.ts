import type { BoxConfig, CylinderConfig, HalfSpaceConfig, Point, Range } from "../generated/api.ts";

/**
 * The plan view: the robot seen from above. Its drawing has mm, x to the right and y up; axis a is at the origin, and
 * the boom points along y at a = 0 and turns towards x.
 */
export type Zone = BoxConfig | CylinderConfig | HalfSpaceConfig;
export type Place2 = readonly [x: number, y: number];

/** A rectangle [m]. */
export interface Extent {
  low: Place2;
  high: Place2;
}

/** Returns a place [m] in the drawing. */
export function drawn([x, y]: readonly [number, number, ...number[]]): [number, number] {
  return [1000 * x, y === 0 ? 0 : -1000 * y];
}

/** Returns a place of the drawing [m], to whole mm. */
export function placed(right: number, down: number): [number, number] {
  return [Math.round(right) / 1000, down === 0 ? 0 : -Math.round(down) / 1000];
}

/** Returns the point at a distance [m] from axis a with the boom at the angle a [rad]. */
export function polar(d: number, a: number): [number, number] {
  return [d * Math.sin(a), d * Math.cos(a)];
}

/** Returns what the gripper can ever reach, and axis a, with a border [m]. */
export function extent(boom: Range, farthest: number, border = 0.1): Extent {
  const [from, to] = boom;
  const points: [number, number][] = [[0, 0]];
  for (let i = 0; i <= 32; i++) points.push(polar(farthest, from + ((to - from) * i) / 32));
  return around(points, border);
}

/** Returns the extent of points with a border [m]. */
export function around(points: readonly Place2[], border: number): Extent {
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  return {
    low: [Math.min(...xs) - border, Math.min(...ys) - border],
    high: [Math.max(...xs) + border, Math.max(...ys) + border],
  };
}

/** Returns the view box of an extent. */
export function viewBox({ low, high }: Extent): string {
  return [1000 * low[0], -1000 * high[1], 1000 * (high[0] - low[0]), 1000 * (high[1] - low[1])].map(Math.round).join(" ");
}

/** Distances between two values on the axes [m], from which the smallest is taken that leaves room for them. */
const STEPS = [0.1, 0.2, 0.5, 1, 2];

/** Least distance between two values on the axes on the screen [px]. */
const ROOM = 56;

/** Returns the distance between two values on the axes [m] if a mm of the drawing has so many pixels. */
export function tickStep(scale: number): number {
  return STEPS.find((one) => 1000 * one * scale >= ROOM) ?? 5;
}

/** Returns the values on an axis between two places, whole multiples of a step [m]. */
export function ticks(low: number, high: number, step: number): number[] {
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.max(0, Math.floor(high / step) - first + 1) }, (_, i) => exact((first + i) * step));
}

const text = (point: readonly [number, number]) => drawn(point).map((one) => one.toFixed(1)).join(" ");

/** Returns the outline of a ring within the range of the boom. */
export function sector(ring: Range, boom: Range): string {
  const [near, far] = ring;
  const [from, to] = boom;
  const wide = to - from > Math.PI ? 1 : 0;
  const arc = (d: number, a: number, sweep: 0 | 1) => `A ${(1000 * d).toFixed(1)} ${(1000 * d).toFixed(1)} 0 ${wide} ${sweep} ${text(polar(d, a))}`;
  return `M ${text(polar(near, from))} L ${text(polar(far, from))} ${arc(far, to, 1)} L ${text(polar(near, to))} ${arc(near, from, 0)} Z`;
}

/** Returns a line through places. */
export function line(points: readonly (readonly [number, number, ...number[]])[]): string {
  return points.map((one, i) => `${i === 0 ? "M" : "L"} ${text([one[0], one[1]])}`).join(" ");
}

/** Whether a zone with its margin is at the height z [m]. */
export function isAt(zone: Zone, z: number): boolean {
  if (zone.kind === "half_space") return true;
  const [low, high] = zone.kind === "box" ? [zone.low[2], zone.high[2]] : [zone.low, zone.high];
  return low - zone.margin <= z && z <= high + zone.margin;
}

/** Returns the outline of a zone seen from above, grown by `margin` [m]; a half-space is cut at the height z [m]. */
export function outlineOf(zone: Zone, z: number, view: Extent, margin = 0): string {
  if (zone.kind === "box") {
    const [x0, y0, x1, y1] = [zone.low[0] - margin, zone.low[1] - margin, zone.high[0] + margin, zone.high[1] + margin];
    return `${line([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])} Z`;
  }
  if (zone.kind === "cylinder") {
    const r = zone.radius + margin;
    const half = (x: number) => `A ${(1000 * r).toFixed(1)} ${(1000 * r).toFixed(1)} 0 1 1 ${text([x, zone.y])}`;
    return `M ${text([zone.x - r, zone.y])} ${half(zone.x + r)} ${half(zone.x - r)} Z`;
  }
  const corners = forbidden(zone, z, view, margin);
  return corners.length < 3 ? "" : `${line(corners)} Z`;
}

/** Returns the part of the view on the forbidden side of a half-space: its normal points out of that side. */
export function forbidden(zone: HalfSpaceConfig, z: number, view: Extent, margin = 0): [number, number][] {
  const size = Math.hypot(...zone.normal);
  const [nx, ny, nz] = zone.normal.map((one) => one / size) as [number, number, number];
  const height = ([x, y]: Place2) => nx * (x - zone.point[0]) + ny * (y - zone.point[1]) + nz * (z - zone.point[2]) - margin;
  const corners: Place2[] = [view.low, [view.high[0], view.low[1]], view.high, [view.low[0], view.high[1]]];
  const kept: [number, number][] = [];
  corners.forEach((here, i) => {
    const next = corners[(i + 1) % corners.length] as Place2;
    const [h, g] = [height(here), height(next)];
    if (h <= 0) kept.push([here[0], here[1]]);
    if (h <= 0 !== g <= 0) {
      const share = h / (h - g);
      kept.push([here[0] + share * (next[0] - here[0]), here[1] + share * (next[1] - here[1])]);
    }
  });
  return kept;
}

/** The directions of the arrow keys in the plan view. */
export const ARROWS: Readonly<Record<string, Place2>> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Returns a length in whole mm [m]. */
export function fine(metres: number): number {
  return Math.round(metres * 1000) / 1000;
}

/** Returns a length [m] without what sums of decimal fractions leave. */
export function exact(metres: number): number {
  return Math.round(metres * 1e6) / 1e6;
}

/** Returns a zone moved by a distance [m]. */
export function moved<Z extends Zone>(zone: Z, ...way: [dx: number, dy: number, dz?: number]): Z {
  const by = (i: number, ...values: number[]) => values.map((value) => (way[i] ? fine(value + way[i]) : value));
  if (zone.kind === "box") {
    const ends = zone.low.map((low, i) => by(i, low, zone.high[i]!));
    return { ...zone, low: ends.map(([low]) => low), high: ends.map(([, high]) => high) };
  }
  if (zone.kind === "cylinder") {
    const [[x], [y], [low, high]] = [by(0, zone.x), by(1, zone.y), by(2, zone.low, zone.high)];
    return { ...zone, x, y, low, high };
  }
  return { ...zone, point: zone.point.map((value, i) => by(i, value)[0]) };
}

/** Returns the middle of a zone with a volume [m]. */
export function centreOf(zone: BoxConfig | CylinderConfig): Point {
  const [x, y] = middleOf(zone);
  const [low, high] = zone.kind === "box" ? [zone.low[2], zone.high[2]] : [zone.low, zone.high];
  return [x, y, (low + high) / 2];
}

/** Returns the middle of a zone, seen from above [m]. */
export function middleOf(zone: Zone): [number, number] {
  if (zone.kind === "box") return [(zone.low[0] + zone.high[0]) / 2, (zone.low[1] + zone.high[1]) / 2];
  return zone.kind === "cylinder" ? [zone.x, zone.y] : [zone.point[0], zone.point[1]];
}
