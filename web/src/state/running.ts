import { computed, ref, watch } from "vue";
import type { JobLine } from "../generated/api.ts";
import { clock, shortDuration, t } from "../words/index.ts";
import { LIVE } from "../words/live.ts";
import { readings } from "./readings.ts";
import { clockSpeed, queue, state } from "./robot.ts";

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

/** The number of waiting jobs, held ones too; the view of the queue lists only the first of them. */
export const waitingCount = computed(() => (queue.value?.counts["queued"] ?? 0) + (queue.value?.counts["held"] ?? 0));

/** The present time [ms], once a second. */
export const now = ref(Date.now());
setInterval(() => (now.value = Date.now()), 1000);

let arrivedAt = Date.now();
watch(queue, () => (arrivedAt = Date.now()), { flush: "sync" });

/** Returns when a job of the queue will have ended, by the service's `eta`; null if nobody knows. */
export function endOf(line: JobLine): Date | null {
  return line.eta === null ? null : new Date(arrivedAt + (line.eta / clockSpeed.value) * 1000);
}

/** Returns the time until then [s]. */
export function leftOf(line: JobLine): number | null {
  const end = endOf(line);
  return end === null ? null : Math.max(0, (end.getTime() - now.value) / 1000);
}

/** Returns in words how long something took, by the clock on the wall; `seconds` are those of the robot's clock. */
export function took(seconds: number | null | undefined): string {
  return shortDuration(seconds == null ? seconds : seconds / clockSpeed.value);
}

/** The present speed of all motion, as a share of the full one. */
export const override = computed(() => state.value?.override ?? 1);

/** Returns in words how long something will take at the present speed; `seconds` are predicted at full speed. */
export function willTake(seconds: number | null | undefined): string {
  return took(seconds == null ? seconds : seconds / override.value);
}

/** Returns in words when something will be done, "" if nobody knows. */
export function doneText(end: Date | null): string {
  return end === null ? "" : t(queue.value?.estimated ? LIVE.doneAbout : LIVE.doneAt, { time: clock(end) });
}
