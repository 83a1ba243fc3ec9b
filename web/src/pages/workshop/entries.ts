import type { LogEntry } from "../../generated/api.ts";

/** The page keeps so many entries of the log. */
export const MOST_ENTRIES = 1000;

/**
 * Returns the entries with the newer ones appended, at most `MOST_ENTRIES`. The newer ones were read from the date of the
 * last known entry on, so that they contain the known entries of this date again.
 */
export function appended(known: readonly LogEntry[], newer: readonly LogEntry[]): LogEntry[] {
  const from = newer[0]?.time;
  if (from === undefined) return [...known];
  return [...known.filter((one) => one.time < from), ...newer].slice(-MOST_ENTRIES);
}

/** Returns the entries whose text, kind or code contains every word of `text`, in upper or lower case. */
export function matching(entries: readonly LogEntry[], text: string): LogEntry[] {
  const wanted = text.toLowerCase().split(/\s+/).filter(Boolean);
  if (wanted.length === 0) return [...entries];
  return entries.filter((one) => {
    const searched = `${one.text} ${one.kind} ${one.code || ""} ${one.level}`.toLowerCase();
    return wanted.every((word) => searched.includes(word));
  });
}

/** Returns the details of an entry as short text, such as "job 3, step 2". */
export function detailed(detail: Record<string, unknown> | undefined): string {
  return Object.entries(detail ?? {})
    .map(([key, value]) => `${key} ${typeof value === "object" ? JSON.stringify(value) : String(value)}`)
    .join(", ");
}
