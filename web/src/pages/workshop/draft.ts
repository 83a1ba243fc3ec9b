import { shallowRef } from "vue";

/** The edited texts of settings by their dotted names. They stay while other pages are shown, and over a lost connection. */
export const draft = shallowRef<Readonly<Record<string, string>>>({});
