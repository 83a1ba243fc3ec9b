/** The content of the scope: ages [s], 0 is now, and one column for each chosen channel; null is a gap. */
export interface Traces {
  ages: readonly number[];
  columns: readonly (readonly (number | null)[])[];
}

/** States that the service has kept, as columns; its clock runs at `speed` times real time. */
export interface Past {
  end: number;
  speed: number;
  columns: Record<string, { values: readonly unknown[] }>;
}

/** Returns kept states as samples of `columns` with their times [s], of which `now` is that of the newest one's answer. */
export function pastOf(past: Past, now: number, columns: readonly (string | null)[]): [time: number, sample: number[]][] {
  const times = past.columns["time"]?.values ?? [];
  const number = (value: unknown) => (typeof value === "number" ? value : Number.NaN);
  return times.map((time, i) => [
    now - (past.end - number(time)) / past.speed,
    columns.map((one) => (one === null ? Number.NaN : number(past.columns[one]?.values[i]))),
  ]);
}

/** The least and the greatest age that is shown [s]. */
export type Span = readonly [number, number];

/** Returns the indices [first, last) of the ages in a span. */
export function inside(ages: readonly number[], [low, high]: Span): [number, number] {
  const first = ages.findIndex((age) => age >= low);
  if (first < 0) return [0, 0];
  const after = ages.findIndex((age) => age > high);
  return [first, Math.max(first, after < 0 ? ages.length : after)];
}

/** Returns the least and the greatest known value between two indices, null if none is known. */
export function extremes(column: readonly (number | null)[], first: number, last: number): [number, number] | null {
  let found: [number, number] | null = null;
  for (let i = first; i < last; i++) {
    const value = column[i];
    if (value === null || value === undefined) continue;
    found = found === null ? [value, value] : [Math.min(found[0], value), Math.max(found[1], value)];
  }
  return found;
}

/** Returns the index of the age that is nearest to `age`, -1 without samples. */
export function nearest(ages: readonly number[], age: number): number {
  let best = -1;
  for (let i = 0; i < ages.length; i++) {
    if (best < 0 || Math.abs((ages[i] as number) - age) < Math.abs((ages[best] as number) - age)) best = i;
  }
  return best;
}

function quoted(text: string): string {
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Returns the samples in a span as CSV (RFC 4180): ages [s] first, then the columns; gaps are empty. */
export function csv(names: readonly string[], traces: Traces, span: Span): string {
  const [first, last] = inside(traces.ages, span);
  const rows = [["age [s]", ...names].map(quoted).join(",")];
  for (let i = first; i < last; i++) {
    const values = traces.columns.map((column) => column[i] ?? "");
    rows.push([(traces.ages[i] as number).toFixed(3), ...values].join(","));
  }
  return `${rows.join("\r\n")}\r\n`;
}
