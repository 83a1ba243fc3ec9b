import type { CalibrationPoint, Point, PointResidual } from "../../generated/api.ts";

/** An arrow of the map: where it begins and ends [m on the map], its size [m], and its share of the greatest, 0 to 1. */
export interface Arrow {
  row: number;
  from: readonly [number, number];
  to: readonly [number, number];
  size: number;
  share: number;
  used: boolean;
}

/** Returns the length of a residual [m]. */
export function size(residual: Point): number {
  return Math.hypot(...residual);
}

/** Returns the greatest factor of 1, 2, 5, 10, 20, … with which the longest residual is at most `longest` [m] long. */
export function scale(residuals: readonly Point[], longest: number): number {
  const most = Math.max(0, ...residuals.map(([x, y]) => Math.hypot(x, y)));
  if (most === 0) return 1;
  const wanted = longest / most;
  const decade = 10 ** Math.floor(Math.log10(wanted));
  const step = wanted / decade >= 5 ? 5 : wanted / decade >= 2 ? 2 : 1;
  return Math.max(1, step * decade);
}

/** Returns the residuals of the points that the fit used. */
function usedOf(residuals: readonly PointResidual[]): readonly PointResidual[] {
  return residuals.filter((one) => one.used);
}

/** Returns the factor of the arrows before or after a fit: the longest one of a used point is at most `longest` [m]. */
export function factorOf(residuals: readonly PointResidual[], when: "before" | "after", longest: number): number {
  return scale(usedOf(residuals).map((one) => one[when]), longest);
}

/**
 * Returns the arrows of the residuals before or after a fit, from the measured places, `factor` times as long. Arrows of
 * points that the fit left out are at most `longest` [m] long.
 */
export function arrows(
  points: readonly CalibrationPoint[],
  residuals: readonly PointResidual[],
  when: "before" | "after",
  factor: number,
  longest: number,
): Arrow[] {
  const places = new Map(points.map((one) => [one.row, one.measured]));
  const greatest = Math.max(0, ...usedOf(residuals).map((one) => Math.max(size(one.before), size(one.after))));
  return residuals.flatMap((one) => {
    const place = places.get(one.row);
    if (place === undefined) return [];
    const [x, y] = place;
    const residual = one[when];
    const long = size(residual);
    const flat = Math.hypot(residual[0], residual[1]) * factor;
    const by = one.used || flat <= longest ? factor : (factor * longest) / flat;
    return [
      {
        row: one.row,
        from: [x, y] as const,
        to: [x + residual[0] * by, y + residual[1] * by] as const,
        size: long,
        share: greatest === 0 ? 0 : Math.min(1, long / greatest),
        used: one.used,
      },
    ];
  });
}
