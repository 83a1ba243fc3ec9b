import type { EventMessage } from "../generated/api.ts";
import declared from "../generated/events.json";
import { STATES } from "./common.ts";
import { translated } from "./errors.ts";
import { language, t, words, type Words } from "./index.ts";
import { PHASES } from "./live.ts";
import { filledIn } from "./sentences.ts";

interface Declared {
  words: readonly string[];
  level: string;
  narrated: boolean;
}

const EVENTS: Record<string, Declared | undefined> = declared;

/** Words that stand in details of events, beside the states of jobs. */
const DETAILS = words({
  taken: ["taken", "tomado"],
  released: ["released", "soltado"],
  expired: ["expired", "caducado"],
  "handed over": ["handed over", "cedido"],
  offered: ["offered", "ofrecido"],
  asked: ["asked for", "pedido"],
  broken: ["taken away by an administrator", "quitado por un administrador"],
  "signed out": ["signed out", "sesión cerrada"],
  pausing: ["pauses", "se pone en pausa"],
  failing: ["it cannot be written", "no se puede escribir"],
  working: ["it can be written again", "se puede escribir de nuevo"],
});

/** Why a recording was saved. */
export const REASONS: Record<string, Words> = words({
  asked: ["asked for", "a petición"],
  fault: ["fault", "fallo"],
  limit: ["limit switch", "final de carrera"],
  estop: ["emergency stop", "parada de emergencia"],
  disconnected: ["connection lost", "conexión perdida"],
  crash: ["defect of the program", "defecto del programa"],
});

/** Returns the reason of a recording in words. */
export function reasonText(reason: string): string {
  const known = REASONS[reason];
  return known === undefined ? reason : t(known);
}

function detailText(kind: string, name: string, value: unknown): unknown {
  if (typeof value !== "string") return value;
  const tables: Record<string, Record<string, Words | undefined>> = {
    state: { ...DETAILS, ...STATES },
    change: DETAILS,
    reason: kind === "recording" ? REASONS : {},
    name: kind === "phase" ? PHASES : {},
  };
  const known = tables[name]?.[value];
  return known === undefined ? value : t(known);
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
  const message = translated(event.code, String(event.detail["message"] ?? ""));
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
