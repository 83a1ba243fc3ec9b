import { computed, ref, shallowRef, watch } from "vue";
import { ask } from "../../api/ask.ts";
import type { Job, JobMistake, JobPreview } from "../../generated/api.ts";
import { EMPTY, firstGap, stepOfKey, tidy, type JobData } from "../../parts/job.ts";
import { failureOf, type Failure } from "../../state/act.ts";
import { forTab } from "../../state/kept.ts";
import { whenLive } from "../../state/load.ts";
import { connection } from "../../state/robot.ts";

/**
 * The job that a person writes, as text and as data. The service translates: a change of the text is parsed, a change of
 * the data is formatted, and the newest change wins. The draft outlives a break of the connection and a restart of the
 * service; its text also a reload of the page, and ends with the tab.
 */
const KEY = "maya.draft";
const PAUSE = 300;

export const text = ref(forTab.get(KEY) ?? "");
export const job = shallowRef<JobData>(EMPTY);
export const mistake = shallowRef<JobMistake | null>(null);

/** Why the service could not translate the newest change. */
export const problem = ref<Failure | null>(null);

/** A draft that was replaced, and why: it can be brought back. */
export const former = shallowRef<{ text: string; why: "replaced" | "comments" } | null>(null);

/** A preview, and the change of the draft that it shows. */
export const preview = shallowRef<{ of: number; found: JobPreview } | null>(null);

/** The number of the newest change. */
export const change = ref(0);

/** Which side is newer than the other: its translation is under way, or waits for the connection. */
export const ahead = ref<"text" | "blocks" | null>(text.value === "" ? null : "text");

/** The first thing that is not filled in: the service sees the job only when nothing is missing. */
export const gap = computed(() => (ahead.value === "text" ? null : firstGap(job.value)));

/** The step that the service's refusal names. */
export const refusedStep = computed(() => stepOfKey(String(problem.value?.details["key"] ?? "")));

/** Whether the job can be previewed and submitted. */
export const complete = computed(
  () => ahead.value === null && mistake.value === null && problem.value === null && job.value.steps.length > 0 && gap.value === null,
);

/** Whether there is a draft, or a person opened the text to write one: until then the page shows only ways to begin. */
export const opened = ref(false);
export const begun = computed(() => opened.value || text.value !== "" || job.value.steps.length > 0);

/** Whether the person has changed the draft since it was put there. */
let own = text.value !== "";
let timer: ReturnType<typeof setTimeout> | undefined;
let reading: Promise<void> = Promise.resolve();
let writing = false;

watch(text, (value) => forTab.set(KEY, value));
whenLive(catchUp);

/** Takes a change of the text; it is parsed when the person pauses. */
export function write(value: string): void {
  own = true;
  text.value = value;
  change.value += 1;
  ahead.value = "text";
  clearTimeout(timer);
  timer = setTimeout(() => void read(), PAUSE);
}

/** Puts another text in the place of the draft, which can be brought back. */
export function replace(value: string, why: "replaced" | null = "replaced"): void {
  former.value = why !== null && own && text.value.trim() !== "" && text.value !== value ? { text: text.value, why } : null;
  write(value);
  own = why === null;
  void read();
}

export function bringBack(): void {
  const before = former.value;
  if (before !== null) replace(before.text, null);
}

/** Takes a change of the blocks, on top of the newest text. While the text has a mistake, nothing changes. */
export async function edit(changed: (job: JobData) => JobData): Promise<void> {
  if (ahead.value === "text") await read();
  if (mistake.value !== null) return;
  if (/(^|\s)#/.test(text.value)) former.value = { text: text.value, why: "comments" };
  own = true;
  job.value = tidy(changed(job.value));
  change.value += 1;
  ahead.value = "blocks";
  problem.value = null;
  void format();
}

function catchUp(): void {
  if (ahead.value === "text") void read();
  else if (ahead.value === "blocks") void format();
}

function read(): Promise<void> {
  clearTimeout(timer);
  reading = parse();
  return reading;
}

async function parse(): Promise<void> {
  const mine = change.value;
  if (text.value.trim() === "") return settle(mine, EMPTY, null);
  if (connection.value !== "live") return; // the next connection reads it
  try {
    const found = await ask("POST /v1/jobs/parse", { body: { text: text.value } });
    settle(mine, found.job as JobData | null, found.mistake);
  } catch (error) {
    fail(mine, error);
  }
}

function settle(mine: number, found: JobData | null, wrong: JobMistake | null): void {
  if (mine !== change.value) return;
  if (found !== null) job.value = found;
  mistake.value = wrong;
  problem.value = null;
  ahead.value = null;
}

/** Shows a refusal. If the request did not reach the service, the text is translated when the connection is back. */
function fail(mine: number, error: unknown): void {
  if (mine !== change.value) return;
  const failure = failureOf(error);
  problem.value = failure;
  if (failure.code !== 0) ahead.value = null;
}

async function format(): Promise<void> {
  if (writing || connection.value !== "live") return;
  writing = true;
  let mine = -1;
  while (ahead.value === "blocks" && mine !== change.value && firstGap(job.value) === null && job.value.steps.length > 0) {
    mine = change.value;
    try {
      const found = await ask("POST /v1/jobs/format", { body: job.value as unknown as Job });
      if (mine !== change.value) continue;
      text.value = found.text;
      problem.value = null;
      ahead.value = null;
    } catch (error) {
      fail(mine, error);
    }
  }
  writing = false;
}
