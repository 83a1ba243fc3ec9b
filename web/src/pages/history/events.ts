import type { EventMessage } from "../../generated/api.ts";
import declared from "../../generated/events.json";
import { DETAILS } from "../../generated/vocabulary.ts";
import { translated } from "../../state/translations.ts";
import { filledIn, language, type Words, wordText } from "../../words/index.ts";

interface Declared {
  words: readonly string[];
  level: string;
  narrated: boolean;
}

const EVENTS: Record<string, Declared | undefined> = declared;

/** The texts of the words in details, by the word of the event and the name of the detail. */
const WORDS: Record<string, Record<string, Readonly<Record<string, Words>>> | undefined> = DETAILS;

/** Returns a detail as text: a word of a vocabulary in the language of the page, anything else unchanged. */
function detailText(kind: string, name: string, value: unknown): unknown {
  const table = WORDS[kind]?.[name];
  if (table === undefined || typeof value !== "string") return value;
  return Object.hasOwn(table, value) ? wordText(table, value) : translated(value);
}

/** Returns what happened as a sentence, with the message of its error. */
export function sentenceOf(event: EventMessage): string {
  const template = EVENTS[event.kind]?.words[language.value === "es" ? 1 : 0];
  const shown = Object.fromEntries(
    Object.entries(event.detail).map(([name, value]) => [name, detailText(event.kind, name, value)]),
  );
  const text =
    template === undefined
      ? [event.kind, ...Object.entries(event.detail).map(([name, value]) => `${name} ${value}`)].join(" ")
      : filledIn(template, shown).trim();
  const message = translated(String(event.detail["message"] ?? ""));
  const holder = event.kind === "lease" && event.detail["holder"] ? `: ${event.detail["holder"]}` : "";
  const sentence = text.charAt(0).toUpperCase() + text.slice(1) + holder;
  return message === "" ? sentence : `${sentence}: ${message}`;
}

export type Tone = "" | "ok" | "warn" | "bad";

/** The colour of an event: that of its level, or of an end of a job. */
export function toneOf(event: EventMessage): Tone {
  const level = EVENTS[event.kind]?.level;
  if (event.detail["state"] === "failed") return "bad";
  if (event.kind === "storage" && event.detail["state"] === "working") return "ok";
  if (level === "error") return "bad";
  if (level === "warning") return "warn";
  return event.kind === "job" && event.detail["state"] === "done" ? "ok" : "";
}

/** Whether an event belongs in the short list: those that the command line shows, and jobs and recordings. */
export function important(event: EventMessage): boolean {
  const known = EVENTS[event.kind];
  if (known === undefined || toneOf(event) !== "") return true;
  if (event.kind === "job" || event.kind === "recording" || event.kind === "queue") return event.detail["state"] !== "queued";
  return known.narrated && event.kind !== "phase" && event.detail["state"] !== "queued";
}
