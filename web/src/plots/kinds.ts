import type uPlot from "uplot";
import { computed } from "vue";
import { token } from "../look/theme.ts";
import { angleFactor, angleUnit, fixed, lengthFactor, lengthUnit } from "../look/units.ts";
import type { Words } from "../words/index.ts";
import { LIVE } from "../words/live.ts";
import type { NAMES } from "./rings.ts";

/** A plot of some signals: of now, or of a recording. `factor` turns the values of a column into the page's unit. */
export interface Plot {
  words: Words;
  unit: string;
  series: { name: string; tone: string; column: (typeof NAMES)[number]; factor: number }[];
}

const joints = (of: "velocity" | "following_error") =>
  (["a", "b", "c"] as const).map((name, i) => ({ name, tone: `c${i + 1}`, column: `${of}_${name}` as const, factor: i === 0 ? angleFactor.value : lengthFactor.value }));

/** The four plots that are shown everywhere, in the units of the page. */
export const plots = computed<Plot[]>(() => [
  { words: LIVE.positionPlot, unit: lengthUnit.value, series: (["x", "y", "z"] as const).map((name, i) => ({ name, tone: `c${i + 1}`, column: name, factor: lengthFactor.value })) },
  { words: LIVE.speedPlot, unit: `${angleUnit.value}/s, ${lengthUnit.value}/s`, series: joints("velocity") },
  { words: LIVE.errorPlot, unit: `${angleUnit.value}, ${lengthUnit.value}`, series: joints("following_error") },
  { words: LIVE.tensionPlot, unit: "×", series: (["b", "c"] as const).map((name, i) => ({ name, tone: `c${i + 2}`, column: `tension_${name}` as const, factor: 1 })) },
]);

/** The look of an axis in the present theme: its ink is not CSS. */
export function axisStyle(): uPlot.Axis {
  return { stroke: token("ink-3"), grid: { stroke: token("line"), width: 1 }, ticks: { show: false }, font: "11px Inter" };
}

/** Both axes of a plot: time with these words, and values with as many digits as they need. */
export function axesOf(time: (seconds: number) => string): uPlot.Axis[] {
  return [
    { ...axisStyle(), size: 22, values: (_, ticks) => ticks.map(time) },
    { ...axisStyle(), size: 46, values: (_, ticks) => ticks.map((one) => compact(one, ticks)) },
  ];
}

/** The lines of a plot. */
export function seriesOf(plot: Plot | undefined): uPlot.Series[] {
  return [{}, ...(plot?.series ?? []).map((one) => ({ stroke: token(one.tone), width: 1.5, points: { show: false } }))];
}

/** Returns the range of an axis: that of the values with some room, and never none. */
export function spread(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [0, 1];
  const room = Math.max((high - low) * 0.08, Math.abs(high) * 0.001, 1e-3);
  return [low - room, high + room];
}

/** Returns a tick with as many digits as its neighbours need to differ. */
function compact(value: number, ticks: readonly number[]): string {
  const step = Math.abs((ticks[1] ?? 1) - (ticks[0] ?? 0)) || 1;
  return fixed(value, Math.max(0, Math.min(4, -Math.floor(Math.log10(step) + 1e-9)))).replace("-", "−");
}
