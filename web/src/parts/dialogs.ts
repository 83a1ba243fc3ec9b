import { ref } from "vue";

/** The number of open dialogues: while there is one, the page behind it takes no input, but stop does. */
export const dialogs = ref(0);
