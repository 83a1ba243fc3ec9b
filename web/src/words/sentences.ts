import type { Words } from "./index.ts";

/** The sentence of an error in both languages, and the Spanish words of its details by name. */
export interface Sentence {
  words: Words;
  details?: Record<string, Record<string, string>>;
}

/** Returns the regular expression that matches the sentences of a template: `{name}` stands for a detail. */
function pattern(template: string): RegExp {
  const seen = new Set<string>();
  const pieces = template.split(/\{(\w+)\}/).map((piece, i) => {
    if (i % 2 === 0) return piece.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    const again = seen.has(piece);
    seen.add(piece);
    return again ? `\\k<${piece}>` : `(?<${piece}>.*?)`;
  });
  return new RegExp(`^${pieces.join("")}$`, "s");
}

/** Returns the English word of a Spanish one, or the other way round. */
function word(text: string, table: Record<string, string> | undefined, toSpanish: boolean): string {
  if (table === undefined) return text;
  if (toSpanish) return table[text] ?? text;
  return Object.keys(table).find((english) => table[english] === text) ?? text;
}

/**
 * Returns a sentence of the service, which is English or Spanish, in `language`; any other text unchanged.
 *
 * Messages that all readers share are English, such as a fault or the message of a job. A refusal is in the language that
 * the browser asked for.
 */
export function inLanguage(sentence: Sentence, text: string, language: "en" | "es"): string {
  const toSpanish = language === "es";
  const found = pattern(sentence.words[toSpanish ? 0 : 1]).exec(text);
  if (found === null) return text;
  const shown = sentence.words[toSpanish ? 1 : 0];
  return shown.replace(/\{(\w+)\}/g, (whole, name: string) => {
    const value = found.groups?.[name];
    return value === undefined ? whole : word(value, sentence.details?.[name], toSpanish);
  });
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
