import { shallowRef, watch } from "vue";
import { language } from "./index.ts";
import { inLanguage, type Sentence } from "./sentences.ts";

/** The sentences of all errors by code. They are loaded for people who read Spanish, or whose browser does. */
const sentences = shallowRef<Record<string, Sentence> | null>(null);

const browserInSpanish = navigator.language.toLowerCase().startsWith("es");

watch(
  language,
  async (now) => {
    if (sentences.value !== null || (now === "en" && !browserInSpanish)) return;
    const loaded = await import("../generated/errors.json");
    sentences.value = loaded.default as unknown as Record<string, Sentence>;
  },
  { immediate: true },
);

/** Returns the message of an error with `code` in the language of the page; an unknown sentence unchanged. */
export function translated(code: number, message: string): string {
  const sentence = sentences.value?.[code];
  return sentence === undefined || message === "" ? message : inLanguage(sentence, message, language.value);
}
