import type { DatumView } from "../generated/api.ts";

export const JOINTS = ["a", "b", "c"] as const;

/** Joints in the fields of a form [rad, m, m]; null in an empty one. */
export type Stated = Record<(typeof JOINTS)[number], number | null>;

/** The pose that a form asks for, the first or the second one, and what it proposes. */
export interface Proposal {
  second: boolean;
  pose: Stated;
}

/** Proposes the homed pose for a robot without a datum; the second pose must be measured. */
export function proposalOf(datum: DatumView | null, second: boolean): Proposal {
  const [a, b, c] = second || datum === null ? [null, null, null] : datum.homed_pose;
  return { second, pose: { a, b, c } };
}

/** Returns what the fields hold after a new proposal: joints that a person has typed stay, but not for the other pose. */
export function refilled(stated: Stated, before: Proposal, now: Proposal): Stated {
  const typed = JOINTS.some((one) => stated[one] !== before.pose[one]);
  return typed && now.second === before.second ? stated : now.pose;
}
