import { computed } from "vue";
import { whyNot } from "../state/can.ts";
import { queue, state } from "../state/robot.ts";
import { LIVE } from "../words/live.ts";
import { t } from "../words/index.ts";

/** Whether a job of the queue moves the robot. */
export const jobRuns = computed(() => queue.value?.running != null && queue.value.mode === "running");

/** Why nobody can jog from this page now, "" if it is possible. While the robot moves, the service decides. */
export const jogReason = computed(() => {
  if (jobRuns.value) return t(LIVE.whileJob);
  return state.value?.mode === "moving" ? "" : whyNot("jog");
});
