import { computed, ref, shallowRef } from "vue";
import type { Job, JobMistake, JobPreview, JobText, ParsedJob } from "../../generated/api.ts";
import { EMPTY, firstGap, stepOfKey, tidy, type JobData } from "../../parts/job.ts";
import { failureOf, type Failure } from "../../state/act.ts";
import { Unreachable } from "../../stream/stream.ts";

/** The service that translates between text and data. */
export interface Translator {
  /** Whether it can be asked now. */
  live(): boolean;
  parse(text: string): Promise<ParsedJob>;
  format(job: Job): Promise<JobText>;
}

/** The text is parsed when the person pauses for this time [ms]. */
export const PAUSE = 300;

/**
 * The job that a person writes, as text and as data. The service translates: a change of the text is parsed, a change of
 * the data is formatted, and the newest change wins. The blocks change only when they show the newest text.
 */
export function createDraft(service: Translator, kept = "") {
  const text = ref(kept);
  const job = shallowRef<JobData>(EMPTY);
  const mistake = shallowRef<JobMistake | null>(null);

  /** Why the service could not translate the newest change. */
  const problem = ref<Failure | null>(null);

  /** A text of a person that was replaced, and why: it can be brought back. */
  const former = shallowRef<{ text: string; why: "replaced" | "rewritten" | "comments" } | null>(null);

  /** A preview, and the change of the draft that it shows. */
  const preview = shallowRef<{ of: number; found: JobPreview } | null>(null);

  /** The number of the newest change. */
  const change = ref(0);

  /** Which side is newer than the other: its translation is under way, or waits for the connection. */
  const ahead = ref<"text" | "blocks" | null>(kept === "" ? null : "text");

  /** Whether the service could not read the newest text: the blocks are older, and cannot be changed. */
  const unread = computed(() => ahead.value === "text" && problem.value !== null);

  /** The first thing that is not filled in: the service sees the job only when nothing is missing. */
  const gap = computed(() => (ahead.value === "text" ? null : firstGap(job.value)));

  /** The step that the service's refusal names. */
  const refusedStep = computed(() => stepOfKey(String(problem.value?.details["key"] ?? "")));

  /** Whether the job can be previewed and submitted. */
  const complete = computed(
    () => ahead.value === null && mistake.value === null && problem.value === null && job.value.steps.length > 0 && gap.value === null,
  );

  /** Whether there is a draft, or a person opened the text to write one: until then the page shows only ways to begin. */
  const opened = ref(false);
  const begun = computed(() => opened.value || text.value !== "" || job.value.steps.length > 0);

  /** Whether the person has changed the draft since it was put there. */
  let own = kept !== "";
  /** The text that the service wrote last. */
  let written = "";
  let timer: ReturnType<typeof setTimeout> | undefined;
  let writing = false;

  /** Takes a change of the text; it is parsed when the person pauses. */
  function write(value: string): void {
    own = true;
    text.value = value;
    change.value += 1;
    ahead.value = "text";
    problem.value = null;
    clearTimeout(timer);
    timer = setTimeout(() => void read(), PAUSE);
  }

  /** Puts another text in the place of the draft, which can be brought back. */
  function replace(value: string, kind: "new" | "former" = "new"): void {
    former.value = own && text.value.trim() !== "" && text.value !== value ? { text: text.value, why: "replaced" } : null;
    write(value);
    own = kind === "former";
    void read();
  }

  function bringBack(): void {
    const before = former.value;
    if (before !== null) replace(before.text, "former");
  }

  /** Takes a change of the blocks, on top of the newest text. Until that is parsed, and while it has a mistake, nothing changes. */
  async function edit(changed: (job: JobData) => JobData): Promise<void> {
    if (ahead.value === "text") await read();
    if (ahead.value === "text") problem.value ??= failureOf(new Unreachable());
    if (ahead.value === "text" || mistake.value !== null) return;
    keepFormer();
    own = true;
    job.value = tidy(changed(job.value));
    change.value += 1;
    ahead.value = "blocks";
    problem.value = null;
    void format();
  }

  /** Keeps the text that the service is about to replace, unless it contains nothing that a person wrote. */
  function keepFormer(): void {
    if (text.value.trim() === "" || text.value === written) return;
    const comments = /(^|\s)#/.test(text.value);
    if (own || (comments && former.value === null)) former.value = { text: text.value, why: comments ? "comments" : "rewritten" };
  }

  /** Translates what waited for the connection. */
  function catchUp(): void {
    if (ahead.value === "text") void read();
    else if (ahead.value === "blocks") void format();
  }

  function read(): Promise<void> {
    clearTimeout(timer);
    return parse();
  }

  async function parse(): Promise<void> {
    const mine = change.value;
    if (text.value.trim() === "") return settle(mine, EMPTY, null);
    if (!service.live()) return; // the next connection reads it
    try {
      const found = await service.parse(text.value);
      settle(mine, found.job as JobData | null, found.mistake);
    } catch (error) {
      if (mine === change.value) problem.value = failureOf(error);
    }
  }

  function settle(mine: number, found: JobData | null, wrong: JobMistake | null): void {
    if (mine !== change.value) return;
    if (found !== null) job.value = found;
    mistake.value = wrong;
    problem.value = null;
    ahead.value = null;
  }

  async function format(): Promise<void> {
    if (writing || !service.live()) return;
    writing = true;
    let mine = -1;
    while (ahead.value === "blocks" && mine !== change.value && firstGap(job.value) === null && job.value.steps.length > 0) {
      mine = change.value;
      try {
        const found = await service.format(job.value as unknown as Job);
        if (mine !== change.value) continue;
        text.value = written = found.text;
        problem.value = null;
        ahead.value = null;
      } catch (error) {
        refused(mine, failureOf(error));
      }
    }
    writing = false;
  }

  /** Shows why blocks have no text. A request that did not reach the service is sent again when the connection is back. */
  function refused(mine: number, failure: Failure): void {
    if (mine !== change.value) return;
    problem.value = failure;
    if (failure.code !== 0) ahead.value = null;
  }

  return {
    text, job, mistake, problem, former, preview, change, ahead, unread, gap, refusedStep, complete, opened, begun,
    write, replace, bringBack, edit, catchUp,
  };
}
