import { computed, ref } from "vue";
import { queue } from "./robot.ts";

const postponed = ref(0);

/** The interrupted job that waits for a decision, if any. */
export const recovery = computed(() => queue.value?.recovery ?? null);

/** Whether the person has postponed the decision. A notice then remains. */
export const later = computed(() => recovery.value !== null && postponed.value === recovery.value.job);

export function postpone(): void {
  postponed.value = recovery.value?.job ?? 0;
}

export function takeUp(): void {
  postponed.value = 0;
}
