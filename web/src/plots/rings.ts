import { live, onState, signals, state as present } from "../state/robot.ts";

/** The last `SECONDS` of some signals, sampled at 10 Hz by the time of arrival, in buffers of fixed length. */
export const SECONDS = 20;

/** Time between two samples [ms]. */
export const PERIOD = 100;
export const LENGTH = (SECONDS * 1000) / PERIOD;

/** Names of the columns, as in recordings: places [m], speeds [rad/s, m/s], following errors [rad, m], tensions [loads]. */
export const NAMES = [
  "x", "y", "z", "velocity_a", "velocity_b", "velocity_c",
  "following_error_a", "following_error_b", "following_error_c", "tension_b", "tension_c",
] as const;
export const COLUMNS = NAMES.length;

/** Columns of samples in buffers of fixed length; the newest samples replace the oldest ones. */
export class Rings {
  readonly times: Float64Array;
  readonly values: Float64Array[];
  private count = 0;

  constructor(
    private readonly columns: number = COLUMNS,
    private readonly length: number = LENGTH,
  ) {
    this.times = new Float64Array(length).fill(Number.NaN);
    this.values = Array.from({ length: columns }, () => new Float64Array(length).fill(Number.NaN));
  }

  /** Appends a sample at `time` [s]; NaN makes a gap. */
  push(time: number, sample: readonly number[]): void {
    const at = this.count % this.length;
    this.times[at] = time;
    for (let i = 0; i < this.columns; i++) (this.values[i] as Float64Array)[at] = sample[i] ?? Number.NaN;
    this.count += 1;
  }

  /** Returns the samples in order: ages [s] up to `now`, 0 is now, and the columns `wanted`. Unknown values are null. */
  read(now: number, wanted: readonly number[]): [number[], ...(number | null)[][]] {
    const filled = Math.min(this.count, this.length);
    const order = Array.from({ length: filled }, (_, i) => (this.count - filled + i) % this.length);
    const column = (values: Float64Array) => order.map((at) => (Number.isNaN(values[at]) ? null : (values[at] as number)));
    return [order.map((at) => (this.times[at] as number) - now), ...wanted.map((one) => column(this.values[one] as Float64Array))];
  }
}

export const rings = new Rings();

const NOTHING = [Number.NaN, Number.NaN, Number.NaN];
let latest: { point: readonly number[] | null; velocity: readonly number[] } | null = live.value ? present.value : null;

onState((state) => {
  latest = state === null ? null : { point: state.point, velocity: state.velocity };
});

let sampling: ReturnType<typeof setInterval> | undefined;

/** Begins to sample, once; the buffers are filled also while no plot is shown. */
export function startSampling(): void {
  sampling ??= setInterval(() => {
    const found = signals.value;
    const speeds = latest?.velocity ?? NOTHING;
    rings.push(performance.now() / 1000, [
      ...(latest?.point ?? NOTHING),
      ...speeds,
      ...(latest ? (found?.following_error ?? NOTHING) : NOTHING),
      ...(latest ? (found?.tension ?? NOTHING.slice(0, 2)) : NOTHING.slice(0, 2)),
    ]);
  }, PERIOD);
}
