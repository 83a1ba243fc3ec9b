import { computed, ref } from "vue";
import { forBrowser } from "../state/kept.ts";

/** A text in English and in Spanish. `{name}` is replaced by a value. */
export type Words = readonly [en: string, es: string];

export type Language = "en" | "es";

const KEY = "maya.language";

function initial(): Language {
  const kept = forBrowser.get(KEY);
  if (kept === "en" || kept === "es") return kept;
  return navigator.language.toLowerCase().startsWith("es") ? "es" : "en";
}

export const language = ref<Language>(initial());

/** Declares the language of the document, for screen readers and hyphenation. */
export function applyLanguage(): void {
  document.documentElement.lang = language.value;
}

export function swapLanguage(): void {
  language.value = language.value === "en" ? "es" : "en";
  forBrowser.set(KEY, language.value);
  applyLanguage();
}

/** Declares the texts of a page: every one in both languages. */
export function words<Table extends Record<string, Words>>(table: Table): Table {
  return table;
}

/** Returns a text in the language of the page. */
export function t(text: Words, values: Record<string, string | number> = {}): string {
  const sentence = text[language.value === "es" ? 1 : 0];
  return sentence.replace(/\{(\w+)\}/g, (whole, key: string) => (key in values ? String(values[key]) : whole));
}

/** Returns the text of a word; one that its table lacks, for example of a newer service, unchanged. */
export function wordText(table: Readonly<Record<string, Words>>, word: string): string {
  const known = Object.hasOwn(table, word) ? table[word] : undefined;
  return known === undefined ? word : t(known);
}

/** Returns a sentence with its values in place of `{name}`; `{name:.0%}` is a share in percent, other forms are left out. */
export function filledIn(template: string, values: Record<string, unknown>): string {
  return template.replace(/\{(\w+)(?::([^}]*))?\}/g, (whole, name: string, form: string | undefined) => {
    const value = values[name];
    if (value === undefined || value === null) return whole;
    const share = /^\.(\d)%$/.exec(form ?? "");
    return share === null ? String(value) : `${(Number(value) * 100).toFixed(Number(share[1]))} %`;
  });
}

/** The locale for numbers and dates: clocks have 24 hours in both languages. */
export const locale = computed(() => (language.value === "es" ? "es" : "en-GB"));

export function clock(date: Date, seconds = false): string {
  return date.toLocaleTimeString(locale.value, { hour: "2-digit", minute: "2-digit", ...(seconds && { second: "2-digit" }) });
}

export function dateTime(text: string): string {
  if (!text) return "–";
  return new Date(text).toLocaleString(locale.value, { dateStyle: "medium", timeStyle: "short" });
}

/** Returns a duration [s] as m:ss, or h:mm:ss from one hour on; "–" if it is unknown. */
export function duration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (value: number) => String(value).padStart(2, "0");
  return h > 0 ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)}`;
}

/** Returns a duration [s] as `duration` does, but one below 10 s with a tenth of a second: "0.4 s". */
export function shortDuration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !(seconds < 9.95)) return duration(seconds);
  return `${Math.max(0, seconds).toLocaleString(locale.value, { minimumFractionDigits: 1, maximumFractionDigits: 1 })} s`;
}
