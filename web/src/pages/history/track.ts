import type { Mode, RecordedStates } from "../../generated/api.ts";

type Place = readonly [number, number, number];

/** A state of a recording: between two recorded ones the places are interpolated. */
export interface RecordedState {
  time: number;
  mode: Mode;
  joints: [number, number, number] | null;
  point: [number, number, number] | null;
  gripper_closed: boolean;
  tension: [number, number] | null;
  phase: string;
  velocity: [number, number, number];
  moving: boolean;
}

/** A span of time in one mode [s]. */
export interface ModeSpan {
  mode: Mode;
  from: number;
  to: number;
}

/** Two states that are further apart than this are not joined by a line [s]. */
const LONGEST_GAP = 2;

/** The states of a recording by time [s, the robot's clock]. */
export class Track {
  readonly times: readonly number[];

  constructor(private readonly states: RecordedStates) {
    this.times = this.column("time") as number[];
  }

  get begin(): number {
    return this.times[0] ?? this.states.begin;
  }

  get end(): number {
    return this.times.at(-1) ?? this.states.end;
  }

  /** Returns the values of a column, [] if there is none. */
  column(name: string): readonly (number | string | null)[] {
    return this.states.columns[name]?.values ?? [];
  }

  /** Returns the index of the last state at or before `time`; 0 before the first. */
  indexAt(time: number): number {
    return Math.max(0, lastUpTo(this.times, time, (one) => one));
  }

  /** Returns the state at `time`; it never moves by itself, so a picture of it does not run ahead. */
  at(time: number): RecordedState | null {
    if (this.times.length === 0) return null;
    const i = this.indexAt(time);
    return {
      time,
      mode: this.column("mode")[i] as Mode,
      joints: this.three(["a", "b", "c"], i, time),
      point: this.three(["x", "y", "z"], i, time),
      gripper_closed: this.column("gripper_closed")[i] === 1,
      tension: this.pair(i),
      phase: String(this.column("phase")[i] ?? ""),
      velocity: [0, 0, 0],
      moving: false,
    };
  }

  /** Returns the places of the gripper within `seconds` before `time`. */
  trace(time: number, seconds: number): Place[] {
    const found: Place[] = [];
    for (let i = this.indexAt(time); i >= 0 && (this.times[i] ?? 0) > time - seconds; i--) {
      const place = ["x", "y", "z"].map((name) => this.column(name)[i]);
      if (place.every((one) => typeof one === "number")) found.push(place as unknown as Place);
    }
    return found.reverse();
  }

  /** Returns the spans of time in one mode, in order. */
  spans(): ModeSpan[] {
    const found: ModeSpan[] = [];
    this.column("mode").forEach((mode, i) => {
      const time = this.times[i] ?? 0;
      const last = found.at(-1);
      if (last !== undefined) last.to = time;
      if (last?.mode !== mode) found.push({ mode: mode as Mode, from: time, to: time });
    });
    return found;
  }

  /** Returns the time `steps` states later or earlier. */
  stepped(time: number, steps: number): number {
    const i = this.indexAt(time);
    const between = steps < 0 && (this.times[i] ?? 0) < time - 1e-9; // going back from between two states
    const next = Math.min(this.times.length - 1, Math.max(0, i + steps + (between ? 1 : 0)));
    return this.times[next] ?? time;
  }

  private three(names: readonly string[], i: number, time: number): [number, number, number] | null {
    const share = this.share(i, time);
    const values = names.map((name) => {
      const column = this.column(name);
      const [before, after] = [column[i], column[i + 1]];
      if (typeof before !== "number") return null;
      return share > 0 && typeof after === "number" ? before + (after - before) * share : before;
    });
    return values.includes(null) ? null : (values as [number, number, number]);
  }

  private share(i: number, time: number): number {
    const [before, after] = [this.times[i], this.times[i + 1]];
    if (before === undefined || after === undefined || after - before > LONGEST_GAP || after <= before) return 0;
    return Math.min(1, Math.max(0, (time - before) / (after - before)));
  }

  private pair(i: number): [number, number] | null {
    const [b, c] = [this.column("tension_b")[i], this.column("tension_c")[i]];
    return typeof b === "number" && typeof c === "number" ? [b, c] : null;
  }
}

/** Returns the index of the last of `rows`, which are in order of time, at or before `time`; -1 if there is none. */
export function lastUpTo<Row>(rows: readonly Row[], time: number, timeOf: (row: Row) => number): number {
  let [low, high] = [0, rows.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (timeOf(rows[middle] as Row) <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
