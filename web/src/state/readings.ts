import { computed, shallowRef } from "vue";
import type { Point, State } from "../generated/api.ts";
import { onState, state } from "./robot.ts";

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

const rounded = (values: readonly number[] | null | undefined) => values?.map((one) => Math.round(one * 1e5) / 1e5) as Point | undefined;

/** The present place of the gripper [m] and the joints [rad, m] for fields, in steps that mean something; null if unknown. */
export const herePoint = computed(() => rounded(state.value?.point) ?? null);
export const hereJoints = computed(() => rounded(state.value?.joints) ?? null);
