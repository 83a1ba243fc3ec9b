import type { JobReport, StepResult } from "../../generated/api.ts";

/** Predicted and actual duration [s] of what was both predicted and carried out. */
export interface Comparison {
  predicted: number;
  actual: number;
}

/** Below this predicted duration [s] a difference in percent means nothing. */
const LEAST = 0.5;

/**
 * Returns the comparison of a job: the sums over the steps that were predicted and are done, null if there is none. A
 * homing cannot be predicted, so it would make every job look late.
 */
export function comparisonOf(report: JobReport): Comparison | null {
  const both = report.steps.filter((one) => one.state === "done" && one.predicted !== null && one.duration !== null);
  if (both.length === 0) return null;
  const sum = (value: (one: StepResult) => number | null) => both.reduce((total, one) => total + (value(one) ?? 0), 0);
  return { predicted: sum((one) => one.predicted), actual: sum((one) => one.duration) };
}

/** Returns by how much the actual duration is longer than the predicted one, as a share of it; null if unknown. */
export function difference(predicted: number | null, actual: number | null): number | null {
  if (predicted === null || actual === null || predicted < LEAST) return null;
  return (actual - predicted) / predicted;
}

/** Returns a difference in percent with its sign, like "+2 %"; "–" if it is unknown. */
export function percent(share: number | null): string {
  if (share === null) return "–";
  const whole = Math.round(share * 100);
  return `${whole > 0 ? "+" : whole < 0 ? "−" : "±"}${Math.abs(whole)} %`;
}

/** Below this share a difference is not worth a line. */
const SLIGHT = 0.005;

/** Returns by how much a job took longer than predicted, as a share; null if it is unknown or too little to tell. */
export function deviation(compared: Comparison | null | undefined): number | null {
  const share = compared ? difference(compared.predicted, compared.actual) : null;
  return share === null || Math.abs(share) < SLIGHT ? null : share;
}
