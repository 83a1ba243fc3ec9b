import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { Job, JobText, ParsedJob } from "../src/generated/api.ts";
import type { JobData } from "../src/parts/job.ts";
import { Refusal } from "../src/stream/stream.ts";

vi.stubGlobal("localStorage", { getItem: () => null });
const { createDraft, PAUSE } = await import("../src/pages/queue/drafting.ts");

const HAND = "steps: [home]";
const named = (job: JobData): JobData => ({ ...job, name: "mine" });

/** A service that reads every text as one step, unless it is down or refuses. */
class Service {
  up = true;
  refusal: Error | null = null;
  live = () => this.up;
  parse(text: string): Promise<ParsedJob> {
    if (this.refusal) return Promise.reject(this.refusal);
    return Promise.resolve({ job: { steps: [`read ${text}`] }, mistake: null });
  }
  format(job: Job): Promise<JobText> {
    return Promise.resolve({ text: `written: ${JSON.stringify(job.steps)}\n` });
  }
}

let service: Service;
let draft: ReturnType<typeof createDraft>;
const settled = () => vi.advanceTimersByTimeAsync(PAUSE);

beforeEach(() => {
  vi.useFakeTimers();
  service = new Service();
  draft = createDraft(service);
});
afterEach(() => vi.useRealTimers());

it("puts a change of the blocks on top of the newest text", async () => {
  draft.write(HAND);
  await draft.edit(named);
  await settled();
  expect(draft.job.value).toEqual({ name: "mine", steps: [`read ${HAND}`] });
  expect([draft.ahead.value, draft.text.value]).toEqual([null, `written: ["read ${HAND}"]\n`]);
});

it("keeps a text that nobody could read, and tells why the blocks stay", async () => {
  service.up = false;
  draft.write(HAND);
  expect(draft.unread.value).toBe(false);
  await draft.edit(named);
  await settled();
  expect([draft.text.value, draft.ahead.value, draft.unread.value]).toEqual([HAND, "text", true]);
  service.up = true;
  draft.catchUp();
  await settled();
  expect([draft.ahead.value, draft.unread.value, draft.job.value.steps]).toEqual([null, false, [`read ${HAND}`]]);
});

it.each([4005, 4106])("keeps a text that the service refuses to read (%i)", async (code) => {
  service.refusal = new Refusal(code, "refused");
  draft.write(HAND);
  await settled();
  await draft.edit(named);
  await settled();
  expect([draft.text.value, draft.job.value.steps, draft.problem.value?.code]).toEqual([HAND, [], code]);
  service.refusal = null;
  await draft.edit(named);
  await settled();
  expect([draft.unread.value, draft.job.value.name]).toEqual([false, "mine"]);
});

it.each([
  [HAND, "rewritten"],
  [`${HAND} # mine`, "comments"],
])("brings back a text that a change of the blocks wrote anew: %s", async (text, why) => {
  draft.write(text);
  await settled();
  await draft.edit(named);
  await settled();
  await draft.edit(named);
  await settled();
  expect(draft.former.value).toEqual({ text, why });
  const written = draft.text.value;
  draft.bringBack();
  await settled();
  expect([draft.text.value, draft.former.value]).toEqual([text, { text: written, why: "replaced" }]);
});

it("offers nothing where nothing of a person is lost", async () => {
  draft.replace(HAND);
  await settled();
  await draft.edit(named);
  await settled();
  expect(draft.former.value).toBeNull();
  draft.replace("other");
  expect(draft.former.value?.why).toBe("replaced");
});

it("keeps the draft of the person when the example in its place is changed", async () => {
  draft.write(HAND);
  await settled();
  draft.replace("steps: # an example");
  await settled();
  await draft.edit(named);
  await settled();
  expect(draft.former.value?.text).toBe(HAND);
});
