import { shallowReactive, watch } from "vue";
import { ask } from "../../api/ask.ts";
import type { JobLine } from "../../generated/api.ts";
import { restarts } from "../../state/robot.ts";
import { comparisonOf, type Comparison } from "./durations.ts";

/** Comparisons of ended jobs by number: they never change. null: nothing can be compared. */
const known = shallowReactive(new Map<number, Comparison | null>());
const requested: number[] = [];
const MOST = 1000;
let working = false;

const ENDED = new Set(["done", "failed", "cancelled", "interrupted"]);

watch(restarts, () => known.clear()); // a queue in memory numbers its jobs from 1 again

/** Whether a job may have steps that were both predicted and carried out, by its line in the list. */
function comparable(line: JobLine): boolean {
  return ENDED.has(line.state) && line.done > 0 && (line.predicted ?? 0) > 0;
}

/** Returns the comparison of a job, undefined until it is known. */
export function comparison(line: JobLine): Comparison | null | undefined {
  return comparable(line) ? known.get(line.id) : null;
}

/** Reads the report of a job that has come into view, once; one report at a time. */
export function request(line: JobLine): void {
  if (!comparable(line) || known.has(line.id) || requested.includes(line.id)) return;
  requested.push(line.id);
  if (!working) void work();
}

async function work(): Promise<void> {
  working = true;
  for (let id = requested[0]; id !== undefined; id = requested[0]) {
    const report = await ask("GET /v1/jobs/{job}", { path: { job: id } }).catch(() => null);
    requested.shift();
    if (report === null) continue;
    if (known.size >= MOST) known.clear();
    known.set(id, comparisonOf(report));
  }
  working = false;
}
