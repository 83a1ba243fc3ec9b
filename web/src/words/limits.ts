import type { Distance } from "../generated/api.ts";
import { angle, angleUnit, fixed, length, lengthUnit } from "../look/units.ts";
import { COMMON } from "./common.ts";
import { t, words, type Words } from "./index.ts";

/** The limits of the workspace, by their names in messages. */
const LIMITS = words({
  coupling: ["lines b and c meet", "los cables b y c se encuentran"],
  boom: ["range of the boom", "rango de giro del brazo"],
  inner: ["inner anchor", "anclaje interior"],
  outer: ["outer anchor", "anclaje exterior"],
  floor: ["table top", "mesa"],
  line_b: ["ends of line b", "extremos del cable b"],
  line_c: ["ends of line c", "extremos del cable c"],
  tension_b: ["tension of line b", "tensión del cable b"],
  tension_c: ["tension of line c", "tensión del cable c"],
  boom_start: ["start of the boom's range", "inicio del giro del brazo"],
  boom_end: ["end of the boom's range", "final del giro del brazo"],
  line_b_short: ["shortest length of line b", "longitud mínima del cable b"],
  line_b_long: ["greatest length of line b", "longitud máxima del cable b"],
  line_c_short: ["shortest length of line c", "longitud mínima del cable c"],
  line_c_long: ["greatest length of line c", "longitud máxima del cable c"],
  zone: ["zone {zone}", "zona {zone}"],
});

/** Returns the name of a limit; a zone with its own name. */
export function limitName(one: { limit: string; zone: string }): string {
  const found: Words | undefined = LIMITS[one.limit as keyof typeof LIMITS];
  return found === undefined ? one.limit : t(found, { zone: one.zone });
}

/** Returns a margin with its unit. */
export function marginText(one: Pick<Distance, "margin" | "unit">): string {
  if (one.unit === "rad") return angleUnit.value === "°" ? `${angle(one.margin)}°` : `${angle(one.margin)} rad`;
  if (one.unit === "load") return `${fixed(one.margin, 2)} ${t(COMMON.load)}`;
  return `${length(one.margin)} ${lengthUnit.value}`;
}
