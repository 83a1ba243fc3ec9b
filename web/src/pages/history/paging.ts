import type { JobLine, TaskState } from "../../generated/api.ts";

/** Jobs on a page of the list. */
export const PAGE = 40;

export type Order = "newest" | "oldest";

/** Groups of states that the list can be narrowed to. */
export const GROUPS = {
  open: ["queued", "held", "running", "paused", "interrupted"],
  done: ["done"],
  failed: ["failed"],
  cancelled: ["cancelled", "skipped"],
} as const satisfies Record<string, readonly TaskState[]>;

export type Group = keyof typeof GROUPS;

export interface Wanted {
  text: string;
  owner: string;
  groups: readonly Group[];
  order: Order;
}

/** Returns the query of a page of jobs: the first one, or the one beyond the job with number `beyond`. */
export function queryOf(wanted: Wanted, beyond?: number) {
  const from = beyond === undefined ? {} : wanted.order === "newest" ? { below: beyond } : { above: beyond };
  return {
    ...(wanted.text.trim() && { text: wanted.text.trim() }),
    ...(wanted.owner.trim() && { owner: wanted.owner.trim() }),
    state: wanted.groups.flatMap((one) => GROUPS[one]),
    order: wanted.order,
    limit: PAGE,
    ...from,
  };
}

/** Returns the first page as it is now, followed by those of the older lines that lie beyond it. */
export function joined(first: readonly JobLine[], older: readonly JobLine[], order: Order): readonly JobLine[] {
  const last = first.at(-1);
  if (last === undefined || first.length < PAGE) return first;
  return [...first, ...older.filter((one) => (order === "newest" ? one.id < last.id : one.id > last.id))];
}
