import type { Words } from "./index.ts";

/** The sentence of an error in both languages, the Spanish words of its details by name, and those that are phrases. */
export interface Sentence {
  words: Words;
  details?: Record<string, Record<string, string>>;
  phrases?: string[];
}

type Translator = (text: string) => string;

const patterns = new Map<string, RegExp>();

/** Returns the regular expression that matches the texts of a template: `{name}` stands for a detail. */
function pattern(template: string): RegExp {
  const known = patterns.get(template);
  if (known !== undefined) return known;
  const seen = new Set<string>();
  const parts: string[] = [];
  let part = "";
  for (const [i, piece] of template.split(/\{(\w+)\}/).entries()) {
    if (i % 2 === 0) {
      part += piece.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    } else if (seen.has(piece)) {
      part += `\\k<${piece}>`;
    } else {
      seen.add(piece);
      parts.push(part);
      part = `(?<${piece}>.*?)`;
    }
  }
  // A lookahead takes the first place where its part fits, so that the time grows linearly with the text.
  const first = parts.map((one, i) => `(?=(?<$${i}>${one}))\\k<$${i}>`).join("");
  const made = new RegExp(`^${first}${part}$`, "s");
  patterns.set(template, made);
  return made;
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
 * `phrase` translates the details that are phrases.
 */
export function inLanguage(sentence: Sentence, text: string, language: "en" | "es", phrase: Translator = (one) => one): string {
  const toSpanish = language === "es";
  const found = pattern(sentence.words[toSpanish ? 0 : 1]).exec(text);
  if (found === null) return text;
  const shown = sentence.words[toSpanish ? 1 : 0];
  return shown.replace(/\{(\w+)\}/g, (whole, name: string) => {
    const value = found.groups?.[name];
    if (value === undefined) return whole;
    const known = word(value, sentence.details?.[name], toSpanish);
    return known === value && sentence.phrases?.includes(name) ? phrase(value) : known;
  });
}

interface Shown {
  text: string;
  /** The number of characters that stay as they are. */
  left: number;
}

interface Template {
  from: string;
  to: string;
  pieces: string[];
  details: Sentence["details"];
}

const DEEPEST = 4;
const LONGEST = 1000;

/** The number of results that are kept: many templates ask for the same part of a text, and a page shows a text often. */
const MOST_RESULTS = 1000;

/**
 * Returns a function that translates phrases into `language`, as `translate_phrase` of the service does. A phrase is a
 * part of a sentence, for example a reason; a sentence may stand in a phrase too. If several templates match a text,
 * that one is taken which leaves the fewest characters untranslated.
 */
export function phraseBook(pairs: readonly Words[], sentences: readonly Sentence[], language: "en" | "es"): Translator {
  const toSpanish = language === "es";
  const [from, to] = toSpanish ? ([0, 1] as const) : ([1, 0] as const);
  const known = new Map(pairs.map((pair) => [pair[from], pair[to]]));
  const between = toSpanish ? /(, | and | or )/ : /(, | y | o )/;
  const cut = (text: string) => text.replace(/\.$/, "");
  const templates: Template[] = [
    ...pairs.map((pair) => ({ from: pair[from], to: pair[to], details: undefined })),
    ...sentences.map(({ words, details }) => ({ from: words[from], to: words[to], details })),
    ...sentences.map(({ words, details }) => ({ from: cut(words[from]), to: cut(words[to]), details })),
  ]
    .map((one) => ({ ...one, pieces: one.from.split(/\{\w+\}/) }))
    .filter((one) => one.pieces.length > 1 || !known.has(one.from))
    .sort((a, b) => exactness(b.pieces) - exactness(a.pieces));

  const results = new Map<string, Shown>();

  function* joined(text: string, depth: number): Generator<Shown> {
    const words = text.split(between);
    if (words.every((one, i) => i % 2 === 1 || known.has(one))) yield { text: words.map((one) => known.get(one) ?? one).join(""), left: 0 };
    const colon = text.indexOf(": ");
    if (colon < 0) return;
    const [name, phrase] = [found(text.slice(0, colon), depth - 1), found(text.slice(colon + 2), depth - 1)];
    yield { text: `${name.text}: ${phrase.text}`, left: name.left + phrase.left };
  }

  function* filled(text: string, depth: number): Generator<Shown> {
    for (const template of templates) {
      const details = template.pieces.every((piece) => text.includes(piece)) ? pattern(template.from).exec(text) : null;
      if (details === null) continue;
      let left = 0;
      const shown = template.to.replace(/\{(\w+)\}/g, (whole, name: string) => {
        const value = details.groups?.[name] ?? whole;
        const chosen = word(value, template.details?.[name], toSpanish);
        const part = chosen === value ? found(value, depth - 1) : { text: chosen, left: 0 };
        left += part.left;
        return part.text;
      });
      yield { text: shown, left };
    }
  }

  function found(text: string, depth: number): Shown {
    const whole = known.get(text);
    if (whole !== undefined) return { text: whole, left: 0 };
    const stays = { text, left: text.length };
    if (depth === 0 || text.length > LONGEST) return stays;
    const key = `${depth} ${text}`;
    const before = results.get(key);
    if (before !== undefined) return before;
    const best = [...joined(text, depth), ...filled(text, depth), stays].reduce((best, one) => (one.left < best.left ? one : best));
    if (results.size >= MOST_RESULTS) results.clear();
    results.set(key, best);
    return best;
  }

  return (text) => found(text, DEEPEST).text;
}

/** Orders templates: first those that begin with a text, then those with the longest texts. */
function exactness(pieces: string[]): number {
  return (pieces[0] === "" ? 0 : 1e6) + pieces.join("").length;
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
