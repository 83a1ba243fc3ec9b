import type uPlot from "uplot";
import { computed } from "vue";
import { token } from "../look/theme.ts";
import { angleFactor, angleUnit, fixed, lengthFactor, lengthUnit, units } from "../look/units.ts";
import { COMMON } from "../words/common.ts";
import { t, type Words } from "../words/index.ts";
import { LIVE } from "../words/live.ts";
import type { NAMES } from "./rings.ts";

/** A curve. `factor` turns the values of its column into the page's unit; angles have a scale of their own, at the right. */
export interface Curve {
  name: string;
  tone: string;
  column: (typeof NAMES)[number];
  factor: number;
  unit: string;
  digits: number;
  scale: "y" | "angle";
}

/** A plot of some signals: of now, or of a recording. */
export interface Plot {
  words: Words;
  series: Curve[];
}

const millimetres = computed(() => units.value === "mm");

const joints = (of: "velocity" | "following_error", per: string, finer: number) =>
  (["a", "b", "c"] as const).map(
    (name, i): Curve =>
      i === 0
        ? { name, tone: "c1", column: `${of}_a`, factor: angleFactor.value, unit: angleUnit.value + per, digits: (millimetres.value ? 2 : 4) + finer, scale: "angle" }
        : { name, tone: `c${i + 1}`, column: `${of}_${name}`, factor: lengthFactor.value, unit: lengthUnit.value + per, digits: (millimetres.value ? 1 : 4) + finer, scale: "y" },
  );

/** The four plots that are shown everywhere, in the units of the page. */
export const plots = computed<Plot[]>(() => [
  { words: LIVE.positionPlot, series: (["x", "y", "z"] as const).map((name, i) => ({ name, tone: `c${i + 1}`, column: name, factor: lengthFactor.value, unit: lengthUnit.value, digits: millimetres.value ? 1 : 4, scale: "y" })) },
  { words: LIVE.speedPlot, series: joints("velocity", "/s", 0) },
  { words: LIVE.errorPlot, series: joints("following_error", "", 1) },
  { words: LIVE.tensionPlot, series: (["b", "c"] as const).map((name, i) => ({ name, tone: `c${i + 2}`, column: `tension_${name}`, factor: 1, unit: t(COMMON.load), digits: 2, scale: "y" })) },
]);

/** The look of an axis in the present theme: its ink is not CSS. */
export function axisStyle(): uPlot.Axis {
  return { stroke: token("ink-3"), grid: { stroke: token("line"), width: 1 }, ticks: { show: false }, font: "11px Inter" };
}

/** Returns the unit of the curves of a scale, "" if there is none. */
export function unitOf(plot: Plot | undefined, scale: Curve["scale"]): string {
  return plot?.series.find((one) => one.scale === scale)?.unit ?? "";
}

/** The axes of a plot: time with these words, and values with as many digits as they need; angles at the right. */
export function axesOf(plot: Plot | undefined, time: (seconds: number) => string): uPlot.Axis[] {
  const values: uPlot.Axis.DynamicValues = (_, ticks) => ticks.map((one) => compact(one, ticks));
  const right = { ...axisStyle(), scale: "angle", side: 1, stroke: token("c1"), grid: { show: false }, size: 52, values } as const;
  return [
    { ...axisStyle(), size: 22, values: (_, ticks) => ticks.map(time) },
    { ...axisStyle(), size: 46, values },
    ...(unitOf(plot, "angle") ? [right] : []),
  ];
}

/** The lines of a plot. */
export function seriesOf(plot: Plot | undefined): uPlot.Series[] {
  return [{}, ...(plot?.series ?? []).map((one) => ({ stroke: token(one.tone), width: 1.5, points: { show: false }, scale: one.scale }))];
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
