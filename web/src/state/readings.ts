import { shallowRef } from "vue";
import type { State } from "../generated/api.ts";
import { onState } from "./robot.ts";

/** The latest state for numbers in the page, at most ten times a second. */
export const readings = shallowRef<State | null>(null);

const PERIOD = 100;
let shownAt = 0;
let pending: ReturnType<typeof setTimeout> | undefined;

onState((next) => {
  clearTimeout(pending);
  const wait = shownAt + PERIOD - performance.now();
  const show = () => {
    shownAt = performance.now();
    readings.value = next;
  };
  if (wait <= 0 || next === null) show();
  else pending = setTimeout(show, wait);
});
