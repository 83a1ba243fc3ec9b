import { computed } from "vue";
import { readings } from "./readings.ts";
import { queue } from "./robot.ts";

/** The job under way, if any. */
export const running = computed(() => queue.value?.running ?? null);

/** The progress of a homing under way, if any. */
export const homing = computed(() => (readings.value?.mode === "homing" ? (readings.value.progress ?? null) : null));

/** The part of the homing under way that is done, 0 to 1. */
export const homingShare = computed(() => (homing.value?.count ? (homing.value.number - 0.5) / homing.value.count : 0));

/** The part of the running job that is done, 0 to 1. */
export const share = computed(() => {
  const line = running.value;
  if (line === null || line.steps === 0) return 0;
  const progress = readings.value?.progress ?? null;
  const inMotion = progress && progress.duration > 0 ? Math.min(1, progress.elapsed / progress.duration) : 0;
  return Math.min(1, (line.done + (homing.value === null ? inMotion : homingShare.value)) / line.steps);
});
