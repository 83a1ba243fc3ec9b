import { ref } from "vue";

/** The number of open dialogues. While there is one, the page behind it takes no input; the stop button still does. */
export const dialogs = ref(0);
