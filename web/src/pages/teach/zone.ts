import type { BoxConfig, CylinderConfig, Point } from "../../generated/api.ts";
import { centreOf, moved } from "../../machine/plan.ts";

/** A zone as it is entered; a number that is not one is null. */
export interface ZoneDraft {
  kind: "box" | "cylinder";
  name: string;
  /** Whether it changes the zone with its name. */
  replace: boolean;
  low: [number | null, number | null, number | null];
  high: [number | null, number | null, number | null];
  /** The axis and the radius of a cylinder; its heights are those of `low` and `high`. */
  x: number | null;
  y: number | null;
  radius: number | null;
  margin: number | null;
  lines: boolean;
}

const MARGIN = 0.05;

/** Returns a new zone around a place [m], from the table up to it. */
export function newZone(kind: ZoneDraft["kind"], [x, y, z]: readonly [number, number, number]): ZoneDraft {
  const fine = (value: number) => Math.round(value * 100) / 100;
  return {
    kind,
    name: "",
    replace: false,
    low: [fine(x - 0.1), fine(y - 0.1), 0],
    high: [fine(x + 0.1), fine(y + 0.1), fine(Math.max(0.1, z))],
    x: fine(x),
    y: fine(y),
    radius: 0.1,
    margin: MARGIN,
    lines: true,
  };
}

/** Returns an existing zone for a change. */
export function draftOfZone(zone: BoxConfig | CylinderConfig): ZoneDraft {
  const { name, margin, lines } = zone;
  if (zone.kind === "box") {
    const middle = [0, 1].map((i) => ((zone.low[i] ?? 0) + (zone.high[i] ?? 0)) / 2);
    return { kind: "box", name, replace: true, low: [...zone.low], high: [...zone.high], x: middle[0]!, y: middle[1]!, radius: 0.1, margin, lines };
  }
  const { x, y, radius, low, high } = zone;
  return { kind: "cylinder", name, replace: true, low: [x - radius, y - radius, low], high: [x + radius, y + radius, high], x, y, radius, margin, lines };
}

/** Returns the zone that a draft describes; null while it is not complete or has no volume. */
export function zoneOf(draft: ZoneDraft): BoxConfig | CylinderConfig | null {
  const { kind, name, low, high, x, y, radius, margin, lines } = draft;
  if (margin === null || low[2] === null || high[2] === null || low[2] >= high[2]) return null;
  if (kind === "cylinder") {
    if (x === null || y === null || radius === null || radius <= 0) return null;
    return { kind, name, x, y, radius, low: low[2], high: high[2], margin, lines };
  }
  if ([0, 1].some((i) => low[i] === null || high[i] === null || (low[i] as number) >= (high[i] as number))) return null;
  return { kind, name, low: low as [number, number, number], high: high as [number, number, number], margin, lines };
}

/** Returns a draft at the place of a zone that was dragged. */
export function draggedTo(draft: ZoneDraft, zone: BoxConfig | CylinderConfig): ZoneDraft {
  if (zone.kind === "box") return { ...draft, low: [...zone.low], high: [...zone.high] };
  const [low, high] = [draft.low, draft.high];
  return { ...draft, x: zone.x, y: zone.y, low: [low[0], low[1], zone.low], high: [high[0], high[1], zone.high] };
}

/** Returns a draft whose zone has its middle at a point [m]. */
export function centredAt(draft: ZoneDraft, zone: BoxConfig | CylinderConfig, to: Point): ZoneDraft {
  const from = centreOf(zone);
  return draggedTo(draft, moved(zone, to[0] - from[0], to[1] - from[1], to[2] - from[2]));
}
