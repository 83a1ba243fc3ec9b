import type { PalletInfo, Point } from "../../generated/api.ts";

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
