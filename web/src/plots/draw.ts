import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { nextTick, onMounted, onUnmounted, watch } from "vue";
import { theme } from "../look/theme.ts";
import { units } from "../look/units.ts";
import { language } from "../words/index.ts";

/** Plots by their number: how each one looks, and what it shows. */
export interface Drawing {
  options(number: number): Omit<uPlot.Options, "width" | "height">;
  data(number: number): uPlot.AlignedData;
}

/**
 * Draws a plot into each of the elements `frames`. Plots follow the sizes of their frames. They are made again when theme,
 * units or language change, because their ink is not CSS.
 */
export function usePlots(frames: () => readonly HTMLElement[], drawing: Drawing) {
  let drawn: uPlot[] = [];
  let gone = false;
  const sizeOf = (frame: HTMLElement) => ({ width: frame.clientWidth, height: frame.clientHeight });
  const observer = new ResizeObserver(() => frames().forEach((frame, i) => drawn[i]?.setSize(sizeOf(frame))));

  function build(): void {
    destroy();
    if (gone) return;
    drawn = frames().map((frame, i) => new uPlot({ ...sizeOf(frame), legend: { show: false }, ...drawing.options(i) }, drawing.data(i), frame));
  }

  function destroy(): void {
    for (const plot of drawn) plot.destroy();
    drawn = [];
  }

  onMounted(async () => {
    await nextTick();
    build();
    for (const frame of frames()) observer.observe(frame);
  });
  onUnmounted(() => {
    gone = true;
    observer.disconnect();
    destroy();
  });
  watch([theme, units, language], () => requestAnimationFrame(build));

  return {
    drawn: () => drawn as readonly uPlot[],
    build,
    /** Shows new data in all plots. */
    update: () => drawn.forEach((plot, i) => plot.setData(drawing.data(i))),
  };
}
