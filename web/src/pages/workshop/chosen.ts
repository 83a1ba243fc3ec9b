import { ref } from "vue";

/** The keys of the signals that the scope shows; they stay while other pages are shown. */
export const chosenChannels = ref<readonly string[]>(["error a", "error b", "error c", "torque a", "torque b", "torque c"]);
