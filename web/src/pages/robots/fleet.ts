import type { FleetRobot, FleetStep, FleetView } from "../../generated/api.ts";
import type { Primitive, PrimitiveName } from "../../generated/primitives.ts";
import { angle, angleUnit, length, lengthUnit, place } from "../../look/units.ts";
import { primitiveOf } from "../../parts/job.ts";
import { dateTime, t } from "../../words/index.ts";
import { PRIMITIVES, SWITCH_STATES } from "../../words/primitives.ts";
import { ROBOTS } from "../../words/robots.ts";

/** The colour of a robot's state: the class of its pill. */
export const FLEET_LOOK: Record<FleetRobot["state"], "" | "ok" | "warn" | "bad" | "busy"> = {
  idle: "ok",
  waiting: "busy",
  working: "busy",
  failed: "bad",
  offline: "",
  lost: "bad",
  unknown: "warn",
};

/** After this time without any step, the page says what may hide them [ms]. */
export const QUIET = 60_000;

/** Returns whether no step of any robot was seen for long, though a robot is connected. */
export function isQuiet(view: FleetView, now: number): boolean {
  if (view.link !== "connected" || view.refused || view.since === null || now - Date.parse(view.since) < QUIET) return false;
  const connected = view.robots.some((one) => ["idle", "waiting", "working", "failed"].includes(one.state));
  return connected && view.robots.every((one) => one.step === null && one.waiting === 0 && one.last.length === 0);
}

/** Returns what a step does, with its place in the units of the page; the beginning of its id if its command is unknown. */
export function described(step: FleetStep): string {
  if (step.command === null) return t(ROBOTS.step, { id: step.id.slice(0, 8) });
  if (step.command === "can_teleop") return t(ROBOTS.canTeleop);
  const known = primitiveOf(step.command);
  const name = known === null ? step.command : t(PRIMITIVES[step.command as PrimitiveName]);
  const values = valuesOf(known, step.args ?? {});
  return values === "" ? name : `${name} ${values}`;
}

function valuesOf(known: Primitive | null, args: Record<string, unknown>): string {
  const numbers = (...keys: string[]) => keys.map((key) => (typeof args[key] === "number" ? args[key] : null));
  if (known?.kind === "switch" && known.key in args) return t(SWITCH_STATES[args[known.key] === true ? known.on : known.off]);
  if ("x" in args) return place(numbers("x", "y", "z") as number[]);
  if (!("a" in args)) return "";
  const [a, b, c] = numbers("a", "b", "c");
  return `${angle(a)} ${angleUnit.value}, ${length(b)}, ${length(c)} ${lengthUnit.value}`;
}

/** Returns the time between a date and now [ms, by the clock of the service] in words. */
export function ago(date: string, now: number): string {
  const seconds = Math.max(0, Math.floor((now - Date.parse(date)) / 1000));
  if (seconds < 60) return t(ROBOTS.secondsAgo, { count: seconds });
  if (seconds < 3600) return t(ROBOTS.minutesAgo, { count: Math.floor(seconds / 60) });
  return t(ROBOTS.at, { date: dateTime(date) });
}

/** Returns how many robots are in each state, in the order of `FLEET_LOOK`, without states that no robot is in. */
export function counted(robots: readonly FleetRobot[]): [FleetRobot["state"], number][] {
  const states = Object.keys(FLEET_LOOK) as FleetRobot["state"][];
  return states.map((state) => [state, robots.filter((one) => one.state === state).length] as [FleetRobot["state"], number]).filter(([, count]) => count > 0);
}
