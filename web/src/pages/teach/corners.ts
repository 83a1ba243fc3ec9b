import type { PalletInfo, Point, TaughtPose } from "../../generated/api.ts";
import { exact } from "../../machine/plan.ts";
import type { Grip } from "../../scene/grips.ts";
import type { PalletGrid } from "../../scene/places.ts";

/** A corner of a pallet as it is entered: the name of a pose, or coordinates [m]. */
export interface Corner {
  /** "" for coordinates. */
  pose: string;
  x: number | null;
  y: number | null;
  z: number | null;
}

/** A pallet as it is entered. */
export interface PalletDraft {
  name: string;
  rows: number | null;
  columns: number | null;
  corners: Corner[];
  /** Whether a fourth corner is given. */
  fourth: boolean;
  /** Whether it replaces the pallet with its name. */
  replace: boolean;
}

export const emptyCorner = (): Corner => ({ pose: "", x: null, y: null, z: null });

export function emptyPallet(): PalletDraft {
  return { name: "", rows: 2, columns: 2, corners: [0, 1, 2, 3].map(emptyCorner), fourth: false, replace: false };
}

/** Returns a taught pallet for a change of its corners, which are coordinates now. */
export function draftOf(pallet: PalletInfo): PalletDraft {
  const corner = (point: Point | undefined): Corner => (point ? { pose: "", x: point[0], y: point[1], z: point[2] } : emptyCorner());
  const { name, rows, columns } = pallet;
  return { name, rows, columns, corners: [0, 1, 2, 3].map((i) => corner(pallet.corners?.[i])), fourth: true, replace: true };
}

/** Returns which corners a grid needs, by number: a single row or column has two ends alone. */
export function neededCorners(rows: number | null, columns: number | null, fourth: boolean): number[] {
  if (rows === 1) return [0, 1];
  if (columns === 1) return [0, 2];
  return fourth ? [0, 1, 2, 3] : [0, 1, 2];
}

/** Returns a corner as messages have it; null while it is not complete. Without z it is at the grasp height. */
export function sentCorner(corner: Corner): string | number[] | null {
  if (corner.pose) return corner.pose;
  const { x, y, z } = corner;
  if (x === null || y === null) return null;
  return z === null ? [x, y] : [x, y, z];
}

/** The data that place the corners of pallets: taught poses, and the height of corners without z [m]. */
export interface Known {
  poses: readonly TaughtPose[];
  height: number;
}

/** Returns the place of a corner [m]; null while it is not complete. */
export function placeOf({ pose, x, y, z }: Corner, { poses, height }: Known): Point | null {
  if (pose) return poses.find((one) => one.name === pose)?.point ?? null;
  return x === null || y === null ? null : [x, y, z ?? height];
}

/** Returns the grid that a draft describes, as the service completes its corners; null while one is missing. */
export function gridOf(draft: PalletDraft, known: Known): PalletGrid | null {
  const { rows, columns, fourth } = draft;
  const [first, right, low, last] = draft.corners.map((one) => placeOf(one, known)) as [Point | null, ...(Point | null)[]];
  if (!rows || !columns || !first) return null;
  if (rows === 1) return right ? { rows, columns, corners: [first, right, first, right] } : null;
  if (columns === 1) return low ? { rows, columns, corners: [first, first, low, low] } : null;
  if (!right || !low || (fourth && !last)) return null;
  const opposite = first.map((value, i) => right[i]! + low[i]! - value) as Point;
  return { rows, columns, corners: [first, right, low, fourth ? last! : opposite] };
}

/** The grip that moves a whole pallet; those of its corners have their numbers. */
export const WHOLE = "whole";

/** Returns what can be dragged: corners that are coordinates, and the middle if all corners are. */
export function gripsOf(draft: PalletDraft, known: Known): Omit<Grip, "label">[] {
  const needed = neededCorners(draft.rows, draft.columns, draft.fourth);
  const found = needed.flatMap((i) => {
    const corner = draft.corners[i]!;
    const point = corner.pose ? null : placeOf(corner, known);
    return point ? [{ id: String(i), point }] : [];
  });
  if (found.length < needed.length) return found;
  const middle = [0, 1, 2].map((i) => found.reduce((sum, one) => sum + one.point[i]!, 0) / found.length) as Point;
  return [{ id: WHOLE, point: middle }, ...found];
}

/** Returns a draft whose grip has been dragged to a point [m]. */
export function withGripAt(draft: PalletDraft, id: string, to: Point, known: Known): PalletDraft {
  const from = gripsOf(draft, known).find((one) => one.id === id)?.point;
  if (from === undefined) return draft;
  const way = to.map((value, i) => value - from[i]!);
  const corners = draft.corners.map((corner, i) => {
    const place = id === WHOLE || id === String(i) ? placeOf(corner, known) : null;
    if (place === null || corner.pose) return corner;
    const [x, y, z] = place.map((value, axis) => (way[axis] ? exact(value + way[axis]!) : value)) as Point;
    return { pose: "", x, y, z };
  });
  return { ...draft, corners };
}
