import type { Job, JobLine, Step as JobStep, Task } from "../generated/api.ts";
import { DECLARED, STATEMENTS, type Primitive, type PrimitiveName } from "../generated/primitives.ts";

/**
 * A job as plain data, as the service parses and formats it. Blocks are a view of its steps: nothing else is kept, so
 * blocks and text cannot disagree. Lengths are in m, angles in rad; a number that is not filled in yet is null.
 */
export type JobData = Omit<Job, "steps" | "parts" | "places"> & {
  steps: readonly Step[];
  parts?: Record<string, unknown>;
  places?: Record<string, unknown>;
};

/** A step as plain data: "home", `{pick: …}` or `{for_each: …, do: […]}`. */
export type Step = unknown;

type Statement = (typeof STATEMENTS)[number];

/** The steps that have blocks of their own. Others are shown, and changed in the text. */
export const COMMANDS = [...(Object.keys(DECLARED) as PrimitiveName[]), ...STATEMENTS] as const;

/** Returns the declaration of a primitive, null for another step. */
export function primitiveOf(command: string): Primitive | null {
  return Object.hasOwn(DECLARED, command) ? DECLARED[command as PrimitiveName] : null;
}

export function isStatement(command: string): command is Statement {
  return (STATEMENTS as readonly string[]).includes(command);
}

/** Whether a step is written as its command alone. */
const isBare = (command: string) => primitiveOf(command)?.kind === "nothing";

export const EMPTY: JobData = { steps: [] };

/**
 * A step by its parts: the command, its argument, the steps within it (of a loop, or `then` of an `if`), its share of the
 * speed if it has one, and the steps of `else`.
 */
export interface StepParts {
  command: string;
  argument: unknown;
  inner: readonly Step[] | null;
  speed?: unknown;
  otherwise?: readonly Step[];
}

function isMapping(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

export function readStep(step: Step): StepParts {
  if (typeof step === "string") return { command: step, argument: true, inner: null };
  if (!isMapping(step)) return { command: "", argument: step, inner: null };
  if ("for_each" in step) {
    const inner = step["do"];
    return { command: "for_each", argument: step["for_each"], inner: Array.isArray(inner) ? inner : [] };
  }
  if ("if" in step) return { command: "if", argument: step["if"], inner: listOf(step["then"]), otherwise: listOf(step["else"]) };
  const [command = "", argument = null] = Object.entries(step).find(([key]) => key !== "speed") ?? [];
  return { command, argument: isBare(command) ? true : argument, inner: null, speed: step["speed"] };
}

function listOf(steps: unknown): readonly Step[] {
  return Array.isArray(steps) ? steps : [];
}

export function writeStep(command: string, argument: unknown, inner: readonly Step[] | null = null, speed: unknown = undefined, otherwise: readonly Step[] = []): Step {
  if (command === "if") return { if: argument, then: inner ?? [], ...(otherwise.length > 0 ? { else: otherwise } : {}) };
  if (inner !== null) return { for_each: argument, do: inner };
  if (isBare(command)) return command;
  return speed === undefined || speed === null ? { [command]: argument } : { [command]: argument, speed };
}

/** Returns the share of the speed of a step in percent, null for the full speed: 0.5 and "50 %" are 50. */
export function percentOf(speed: unknown): number | null {
  if (typeof speed === "number") return Math.round(speed * 100);
  const found = typeof speed === "string" ? /^([\d.]+)\s*(%?)$/.exec(speed.trim()) : null;
  return found === null ? null : Math.round(Number(found[1]) * (found[2] ? 1 : 100));
}

/** The target of a step: a name, a cell of a pallet, numbers, or nothing yet. */
export type Target =
  | { kind: "none" }
  | { kind: "name"; name: string }
  | { kind: "cell"; pallet: string; which: "next" | "each" | "number"; row: string; column: string }
  | { kind: "numbers"; values: readonly (number | null)[] };

const CELL = /^(.+?) *\[ *(?:(next|each)|(\d{1,4}|\*) *, *(\d{1,4}|\*)) *\]$/;
const AXES = [["x", "y", "z"], ["a", "b", "c"]] as const;

/** Reads the argument of a step: `cube`, `tray[1,2]`, `[0.5, 1.1]`, `{x: 0.5, y: 1.1}`. */
export function readTarget(argument: unknown): Target {
  if (typeof argument === "string" && argument !== "") {
    const found = CELL.exec(argument);
    if (found === null) return { kind: "name", name: argument };
    const [, pallet = "", word, row = "1", column = "1"] = found;
    const which = word === "next" || word === "each" ? word : "number";
    return { kind: "cell", pallet, which, row, column };
  }
  if (Array.isArray(argument)) return { kind: "numbers", values: argument.map(numberOrNull) };
  if (isMapping(argument)) {
    const axes = AXES.find((names) => names[0] in argument) ?? AXES[0];
    const values = axes.filter((name) => name in argument).map((name) => numberOrNull(argument[name]));
    return { kind: "numbers", values };
  }
  return { kind: "none" };
}

export function writeTarget(target: Target): unknown {
  switch (target.kind) {
    case "none":
      return null;
    case "name":
      return target.name;
    case "cell":
      return `${target.pallet}[${target.which === "number" ? `${target.row || "1"},${target.column || "1"}` : target.which}]`;
    case "numbers":
      return target.values;
  }
}

function numberOrNull(value: unknown): number | null {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}

/** Returns coordinates without an empty z: its place is the grasp height then. */
export function trimmed(values: readonly (number | null)[]): (number | null)[] {
  const found = [...values];
  if (found.length === 3 && found[2] === null) found.pop();
  return found;
}

/** The first part that is not filled in yet: a step by its place in the list (and in its loop), or a name; null if all is. */
export type Gap = { step: number; inner: number | null } | { name: string };

export function firstGap(job: JobData): Gap | null {
  for (const [i, step] of job.steps.entries()) {
    const { command, argument, inner } = readStep(step);
    if (isOpen(command, argument) || (command === "if" && isIncomplete(step))) return { step: i, inner: null };
    const within = inner?.findIndex(isIncomplete) ?? -1;
    if (within >= 0) return { step: i, inner: within };
  }
  for (const group of [job.parts, job.places]) {
    const found = Object.entries(group ?? {}).find(([, place]) => hasHole(place));
    if (found !== undefined) return { name: found[0] };
  }
  return null;
}

/** Whether a step, or a step within it, is not filled in. An `if` needs a step in `then`. */
function isIncomplete(step: Step): boolean {
  const { command, argument, inner, otherwise = [] } = readStep(step);
  return isOpen(command, argument) || (command === "if" && inner?.length === 0) || [...(inner ?? []), ...otherwise].some(isIncomplete);
}

function isOpen(command: string, argument: unknown): boolean {
  if ((command === "if" || isStatement(command)) && isMapping(argument)) return [null, ""].some((empty) => Object.values(argument).includes(empty));
  return !isBare(command) && (argument === null || argument === undefined || argument === "" || hasHole(argument));
}

function hasHole(place: unknown): boolean {
  return Array.isArray(place) && place.some((value) => value === null);
}

/** Returns the place of a key of the service, like `steps.2.pick` or `steps.2.do.0`, in the list of steps. */
export function stepOfKey(key: string): { step: number; inner: number | null } | null {
  const found = /^steps\.(\d+)(?:\.do\.(\d+))?/.exec(key);
  if (found === null) return null;
  return { step: Number(found[1]), inner: found[2] === undefined ? null : Number(found[2]) };
}

const ORDER = ["name", "parts", "places", "pallets", "steps", "repeat"];

/** Returns a job with its keys in the usual order, and without empty groups of names. */
export function tidy(job: JobData): JobData {
  const entries = Object.entries(job).filter(([key, value]) => value !== undefined && !isEmptyGroup(key, value) && !(key === "repeat" && value === 1));
  entries.sort(([one], [other]) => ORDER.indexOf(one) - ORDER.indexOf(other));
  return Object.fromEntries(entries) as unknown as JobData;
}

function isEmptyGroup(key: string, value: unknown): boolean {
  return ["parts", "places", "pallets"].includes(key) && isMapping(value) && Object.keys(value).length === 0;
}

export type NameGroup = "parts" | "places";

/** Returns a name that the job does not use yet: `part`, `part 2` … */
export function freshName(job: JobData, base: string): string {
  const taken = new Set([...Object.keys(job.parts ?? {}), ...Object.keys(job.places ?? {}), ...Object.keys(job.pallets ?? {})]);
  let name = base;
  for (let n = 2; taken.has(name); n++) name = `${base} ${n}`;
  return name;
}

/** Gives a part or place new coordinates, or a new one its first; its place in the list stays. */
export function withName(job: JobData, group: NameGroup, name: string, place: unknown): JobData {
  return tidy({ ...job, [group]: { ...job[group], [name]: place } });
}

/** Renames a part or place, also in all steps. A name that is taken or empty changes nothing. */
export function renamed(job: JobData, group: NameGroup, old: string, name: string): JobData {
  if (name === "" || name === old || freshName(job, name) !== name) return job;
  const entries = Object.entries(job[group] ?? {}).map(([one, place]) => [one === old ? name : one, place] as const);
  return { ...job, [group]: Object.fromEntries(entries), steps: job.steps.map((step) => retargeted(step, old, name)) };
}

function retargeted(step: Step, old: string, name: string): Step {
  const { command, argument, inner, speed, otherwise } = readStep(step);
  if (inner !== null) return writeStep(command, argument, inner.map((one) => retargeted(one, old, name)), speed, otherwise?.map((one) => retargeted(one, old, name)));
  return argument === old && !isStatement(command) ? writeStep(command, name, null, speed) : step;
}

/** Removes a part or place. Steps that name it keep the name, and the service refuses it as unknown. */
export function withoutName(job: JobData, group: NameGroup, name: string): JobData {
  const { [name]: _, ...rest } = job[group] ?? {};
  return tidy({ ...job, [group]: rest });
}

/** New statements; those with a gap are not complete. */
const NEW: Record<Statement | "if", Step> = {
  wait: { wait: 1 },
  set: { set: { output: null, to: "on" } },
  wait_for: { wait_for: { input: null, is: "on" } },
  ask: { ask: null },
  if: { if: { input: null, is: "on" }, then: [] },
};

/** Returns a new step of a command for the end of a job: a pick takes the first part that no step has picked yet. */
export function newStep(job: JobData, command: string, within: string | null = null): Step {
  if (isStatement(command) || command === "if") return NEW[command];
  if (command === "for_each") return { for_each: Object.keys(job.pallets ?? {})[0] ?? null, do: [{ pick: null }] };
  if (command === "pick" && within !== null) return { pick: `${within}[each]` };
  if (command === "pick") return { pick: firstUnused(job, "pick", Object.keys(job.parts ?? {})) };
  if (command === "place") return { place: firstUnused(job, "place", Object.keys(job.places ?? {})) };
  const primitive = primitiveOf(command);
  return writeStep(command, primitive?.kind === "switch" ? primitive.on : null);
}

function firstUnused(job: JobData, command: string, names: string[]): string | null {
  const used = new Set(job.steps.map(readStep).filter((one) => one.command === command).map((one) => one.argument));
  return names.find((name) => !used.has(name)) ?? names[0] ?? null;
}

/** Returns the name of the pallet of a loop: `tray` of `tray[2,*]`. */
export function palletOf(cells: unknown): string {
  const target = readTarget(cells);
  return target.kind === "cell" ? target.pallet : target.kind === "name" ? target.name : "";
}

/** Returns the step of a job that does the same as a task. */
export function stepOf(task: Task): JobStep | "home" {
  return writeStep(task.command, argumentOf(task)) as JobStep | "home";
}

/** Returns the argument of a task as a step has it, null without one. */
function argumentOf(task: Record<string, unknown>): unknown {
  const primitive = primitiveOf(String(task["command"]));
  const value = primitive === null ? null : (task[primitive.key] ?? null);
  return primitive?.kind === "switch" ? (value === true ? primitive.on : primitive.off) : value;
}

/** Returns the task of a primitive with this value of its argument, null while the value is not complete. */
export function taskOf(command: PrimitiveName, value: unknown): Task | null {
  const { kind, key } = DECLARED[command];
  if (kind === "nothing") return { command } as Task;
  return value === null ? null : ({ command, [key]: value } as Task);
}

/** Returns the body of an accepted job as a job: a single command (key `wish`) becomes a job of one step. */
export function bodyAsJob(body: Record<string, unknown>): JobData {
  const single = body["wish"];
  if (!isMapping(single)) {
    const job = Object.fromEntries(ORDER.filter((key) => key in body).map((key) => [key, body[key]])) as unknown as JobData;
    return tidy({ ...job, steps: job.steps.map(plain) });
  }
  const command = String(single["command"]);
  return { name: command, steps: [writeStep(command, argumentOf(single))] };
}

/** Returns the newest job of each name; jobs without a name are left out. `lines` are newest first. */
export function newestByName<Line extends Pick<JobLine, "name">>(lines: readonly Line[]): Line[] {
  return lines.filter((one, i) => one.name !== "" && lines.findIndex((other) => other.name === one.name) === i);
}

/** Returns a step as people write it: `home`, where the service keeps `{home: true}`. */
function plain(step: Step): Step {
  const { command, argument, inner, speed, otherwise } = readStep(step);
  return writeStep(command, argument, inner === null ? null : inner.map(plain), speed, otherwise?.map(plain));
}

/**
 * Returns a job without the step of a report with this `key`, to leave out a step that has not begun. Null if that
 * is not possible: the step is one of a loop, the job is repeated, or the step is its only one.
 */
export function withoutStep(job: JobData, key: string): JobData | null {
  const place = /^steps\.(\d+)$/.exec(key)?.[1];
  if (place === undefined || (job.repeat ?? 1) !== 1 || job.steps.length < 2) return null;
  if (readStep(job.steps[Number(place)]).inner !== null) return null;
  return { ...job, steps: job.steps.filter((_, i) => i !== Number(place)) };
}
