import { ref, watch } from "vue";
import type { JobLine } from "../generated/api.ts";
import { clockSpeed, queue } from "./robot.ts";

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
