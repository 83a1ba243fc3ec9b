import type { JobInspection, Joints } from "../generated/api.ts";

/** The state of robot and service on which the preview of a motion depends. */
export interface Basis {
  /** The run of the service: its configuration changes only when it starts again. */
  run: number | undefined;
  /** The numbers of the latest changes of places and of zones. */
  places: number | undefined;
  zones: number | undefined;
  closed: boolean | undefined;
  /** The place of the robot [rad, m, m]; null if it does not know. */
  joints: Joints | null;
}

/** Joints that differ by less are the same [rad, m]: encoders tell some counts more or less of a robot at rest. */
const SAME = 2e-4;

/** Returns the basis of a preview that was asked for on another one: its motion begins where the service saw the robot. */
export function basisOf(found: Pick<JobInspection, "motions">, asked: Basis): Basis {
  return { ...asked, joints: found.motions[0]?.joints[0] ?? asked.joints };
}

/** Whether a preview still shows what would move: nothing that it depends on has changed. */
export function holds(before: Basis, now: Basis): boolean {
  const others = (["run", "places", "zones", "closed"] as const).every((one) => before[one] === now[one]);
  return others && near(before.joints, now.joints);
}

function near(one: Joints | null, other: Joints | null): boolean {
  if (one === null || other === null) return one === other;
  return one.every((joint, i) => Math.abs(joint - (other[i] ?? 0)) < SAME);
}
