import type { Distance } from "../generated/api.ts";
import { LIMITS } from "../generated/limits.ts";
import { angle, angleUnit, fixed, length, lengthUnit } from "../look/units.ts";
import { COMMON } from "./common.ts";
import { t } from "./index.ts";

/** Returns the name of a limit; a zone with its own name. */
export function limitName(one: { limit: string; zone: string }): string {
  return Object.hasOwn(LIMITS, one.limit) ? t(LIMITS[one.limit as keyof typeof LIMITS], { zone: one.zone }) : one.limit;
}

/** Returns a margin with its unit. */
export function marginText(one: Pick<Distance, "margin" | "unit">): string {
  if (one.unit === "rad") return angleUnit.value === "°" ? `${angle(one.margin)}°` : `${angle(one.margin)} rad`;
  if (one.unit === "load") return `${fixed(one.margin, 2)} ${t(COMMON.load)}`;
  return `${length(one.margin)} ${lengthUnit.value}`;
}
