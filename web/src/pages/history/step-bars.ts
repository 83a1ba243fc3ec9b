import type { StepResult } from "../../generated/api.ts";

/** A column of the chart of a job's steps: where it stands, and the heights of its two bars, all in pixels. */
export interface StepBars {
  index: number;
  x: number;
  width: number;
  predicted: number;
  actual: number;
  /** Whether the bar of the actual duration is cut off: the step was not predicted, and takes longer than all others. */
  cut: boolean;
}

export interface StepChart {
  bars: readonly StepBars[];
  /** Values [s] of the horizontal lines, with their height above the foot. */
  lines: readonly { value: number; height: number }[];
}

/** Returns round values from 0 up to the longest duration, at most six of them. */
export function roundValues(longest: number): readonly number[] {
  if (!(longest > 0)) return [0];
  const rough = longest / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = ([1, 2, 5, 10].find((one) => one * power >= rough) ?? 10) * power;
  return Array.from({ length: Math.floor(longest / step + 1e-9) + 1 }, (_, i) => i * step);
}

/**
 * Returns the chart of predicted and actual durations within `width` times `height` pixels. Steps that cannot be
 * predicted, such as a homing of minutes, do not set the scale.
 */
export function stepChart(steps: readonly StepResult[], width: number, height: number): StepChart {
  const predicted = steps.filter((one) => one.predicted !== null);
  const longest = (predicted.length > 0 ? predicted : steps).reduce((most, one) => Math.max(most, one.predicted ?? 0, one.duration ?? 0), 0);
  const scale = longest > 0 ? height / longest : 0;
  const room = steps.length > 0 ? width / steps.length : 0;
  const gap = Math.min(8, room * 0.3);
  return {
    bars: steps.map((one, i) => ({
      index: one.index,
      x: i * room + gap / 2,
      width: Math.min(36, room - gap),
      predicted: (one.predicted ?? 0) * scale,
      actual: Math.min((one.duration ?? 0) * scale, height),
      cut: (one.duration ?? 0) > longest,
    })),
    lines: roundValues(longest).map((value) => ({ value, height: value * scale })),
  };
}
