import type { Point, TaughtPose } from "../../generated/api.ts";

/** A taught pose that is being moved, with its place as it is entered [m]; a number that is not one is null. */
export interface PoseDraft {
  name: string;
  x: number | null;
  y: number | null;
  z: number | null;
}

/** Returns a taught pose for a change of its place. */
export function draftOfPose({ name, point }: TaughtPose): PoseDraft {
  const [x, y, z] = (point ?? [null, null, null]).map((one) => (one === null ? null : Math.round(one * 1e5) / 1e5));
  return { name, x: x ?? null, y: y ?? null, z: z ?? null };
}

/** Returns the place of a draft [m]; null while it is not complete. */
export function pointOf(draft: PoseDraft | null): Point | null {
  if (draft === null || draft.x === null || draft.y === null || draft.z === null) return null;
  return [draft.x, draft.y, draft.z];
}
