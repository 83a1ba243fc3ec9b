import { computed, shallowRef, watch } from "vue";
import { language, type Words } from "./index.ts";
import { inLanguage, phraseBook, type Sentence } from "./sentences.ts";

interface Texts {
  sentences: Record<string, Sentence>;
  phrases: readonly Words[];
}

/** The sentences of all errors by code, and the phrases in them. They are loaded for people who read Spanish, or whose browser does. */
const texts = shallowRef<Texts | null>(null);

const browserInSpanish = navigator.language.toLowerCase().startsWith("es");

watch(
  language,
  async (now) => {
    if (texts.value !== null || (now === "en" && !browserInSpanish)) return;
    const [errors, phrases] = await Promise.all([import("../generated/errors.json"), import("../generated/phrases.json")]);
    texts.value = {
      sentences: errors.default as unknown as Record<string, Sentence>,
      phrases: phrases.default as unknown as readonly Words[],
    };
  },
  { immediate: true },
);

const book = computed(() => phraseBook(texts.value?.phrases ?? [], Object.values(texts.value?.sentences ?? {}), language.value));

/** Returns a phrase of the service, as the reason why a point is out of reach, in the language of the page. */
export function translatedPhrase(text: string): string {
  return texts.value === null || text === "" ? text : book.value(text);
}

/** Returns the message of an error with `code` in the language of the page; an unknown sentence unchanged. */
export function translated(code: number, message: string): string {
  const sentence = texts.value?.sentences[code];
  return sentence === undefined || message === "" ? message : inLanguage(sentence, message, language.value, translatedPhrase);
}
