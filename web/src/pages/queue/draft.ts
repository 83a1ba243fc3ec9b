import { watch } from "vue";
import { ask } from "../../api/ask.ts";
import { forTab } from "../../state/kept.ts";
import { whenLive } from "../../state/load.ts";
import { connection } from "../../state/robot.ts";
import { createDraft } from "./drafting.ts";

/**
 * The draft of this page. It outlives a break of the connection and a restart of the service; its text also a reload of the
 * page, and ends with the tab.
 */
const KEY = "maya.draft";

const draft = createDraft(
  {
    live: () => connection.value === "live",
    parse: (text) => ask("POST /v1/jobs/parse", { body: { text } }),
    format: (job) => ask("POST /v1/jobs/format", { body: job }),
  },
  forTab.get(KEY) ?? "",
);

export const { text, job, mistake, problem, former, preview, change, ahead, unread, gap, refusedStep, complete, opened, begun } = draft;
export const { write, replace, bringBack, edit } = draft;

watch(text, (value) => forTab.set(KEY, value));
whenLive(draft.catchUp);
