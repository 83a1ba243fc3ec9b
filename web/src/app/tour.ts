import { ref } from "vue";
import { forBrowser } from "../state/kept.ts";

const KEY = "maya.tour";

/** The number of the card that is shown, null for none. */
export const card = ref<number | null>(null);

export function startTour(): void {
  card.value = 0;
}

/** Starts the tour on the first visit of this browser. */
export function offerTour(): void {
  if (forBrowser.get(KEY) !== null) return;
  forBrowser.set(KEY, "shown");
  startTour();
}
