import { ref } from "vue";

const query = matchMedia("(max-width: 720px)");

/** Whether the page has the width of a phone; the style sheets use the same width. */
export const narrow = ref(query.matches);
query.addEventListener("change", () => (narrow.value = query.matches));
