import { ref, watch } from "vue";
import { ask } from "../../api/ask.ts";
import type { Signals, State } from "../../generated/api.ts";
import { PERIOD, Rings } from "../../plots/rings.ts";
import { clockSpeed, hello, live, onState, signals, state } from "../../state/robot.ts";
import type { Words } from "../../words/index.ts";
import { LIVE } from "../../words/live.ts";
import { SCOPE, SIGNALS } from "../../words/workshop.ts";
import type { Quantity } from "./quantities.ts";
import { pastOf } from "./traces.ts";

/** A signal of the scope in SI units: its key is unique, its name is `axis`, or a text about it. */
export interface Channel {
  key: string;
  group: Words;
  words: Words | null;
  axis: string;
  quantity: Quantity;
  /** Its column in the states that the service keeps, null if it keeps none. */
  column: string | null;
  read: (state: State | null, found: Signals | null) => number | boolean | null | undefined;
}

/** The controller has up to so many digital inputs, and so many outputs. */
const BITS = 16;
const AXES = ["a", "b", "c"] as const;

function joints(name: string, group: Words, words: Words | null, kinds: [Quantity, Quantity], read: (i: number) => Channel["read"], column: (axis: string) => string | null = () => null): Channel[] {
  return AXES.map((axis, i) => ({ key: `${name} ${axis}`, group, words, axis, quantity: kinds[i === 0 ? 0 : 1], column: column(axis), read: read(i) }));
}

function bits(name: "inputs" | "outputs", group: Words, words: Words): Channel[] {
  return Array.from({ length: BITS }, (_, i) => ({
    key: `${name} ${i + 1}`,
    group,
    words,
    axis: String(i + 1),
    quantity: "level",
    column: null,
    read: (_state: State | null, found: Signals | null) => found?.[name][i],
  }));
}

/** All signals that the stream carries. */
export const CHANNELS: readonly Channel[] = [
  ...["x", "y", "z"].map((axis, i): Channel => ({ key: axis, group: LIVE.position, words: null, axis, quantity: "length", column: axis, read: (state) => state?.point?.[i] })),
  ...joints("joint", SCOPE.groupJoints, null, ["angle", "length"], (i) => (state) => state?.joints?.[i], (axis) => axis),
  ...joints("speed", LIVE.speedPlot, SCOPE.speedOf, ["angular speed", "speed"], (i) => (state) => state?.velocity[i], (axis) => `velocity_${axis}`),
  ...joints("error", LIVE.errorPlot, SCOPE.errorOf, ["angle", "length"], (i) => (_, found) => found?.following_error[i]),
  ...joints("torque", SIGNALS.torque, SCOPE.torqueOf, ["voltage", "voltage"], (i) => (_, found) => found?.torque[i]),
  ...joints("tension", LIVE.tensionPlot, SCOPE.tensionOf, ["load", "load"], (i) => (_, found) => found?.tension?.[i - 1]).slice(1),
  ...bits("inputs", SCOPE.groupInputs, SCOPE.inputOf),
  ...bits("outputs", SCOPE.groupOutputs, SCOPE.outputOf),
];

/** The keys of the signals that the scope shows; they stay while other pages are shown. */
export const chosen = ref<readonly string[]>(["error a", "error b", "error c", "torque a", "torque b", "torque c"]);

/** Returns the channels of these keys, in their order; unknown keys are left out. */
export function channelsOf(keys: readonly string[]): Channel[] {
  return keys.flatMap((key) => CHANNELS.find((one) => one.key === key) ?? []);
}

/** Returns the colour of a channel: that of its axis everywhere, and of inputs and outputs their order among the chosen. */
export function colour(channel: Channel, chosen: readonly Channel[]): { tone: string; dashed: boolean } {
  const named = "xyz".indexOf(channel.axis) + "abc".indexOf(channel.axis) + 1;
  if (named >= 0) return { tone: `c${named + 1}`, dashed: false };
  const order = chosen.filter((one) => one.group === channel.group).indexOf(channel);
  return { tone: `c${(order % 3) + 1}`, dashed: order >= 3 };
}

/** The scope keeps so many seconds. */
export const KEPT = 60;

/** The samples of all channels; they are taken from the first visit of the scope on. */
export const samples = new Rings(CHANNELS.length, (KEPT * 1000) / PERIOD);

let latest: State | null = null;
let started = false;

/** The service answers with so many seconds of its clock at most. */
const LONGEST = 300;

/** Waits for the greeting of the service, which has the speed of its clock. */
function greeted(): Promise<void> {
  return new Promise((resolve) => {
    watch(hello, (next) => next !== null && resolve(), { immediate: true });
  });
}

/** Begins with the states that the service has kept of the last minute, as far as it has the signals. */
async function readPast(): Promise<void> {
  const speed = clockSpeed.value;
  const columns = CHANNELS.map((one) => one.column);
  const signal = columns.filter((one) => one !== null);
  const query = { seconds: Math.min(KEPT * speed, LONGEST), rate: 1000 / PERIOD / speed, signal };
  const view = await ask("GET /v1/scope", { query, large: true }).catch(() => null);
  if (view === null) return; // nothing is recorded here
  for (const [time, sample] of pastOf(view, performance.now() / 1000, columns)) samples.push(time, sample);
}

/** Begins to sample, once. Without a connection the samples are gaps. */
export async function startScope(): Promise<void> {
  if (started) return;
  started = true;
  latest = live.value ? state.value : null; // a robot at rest sends its next state only after seconds
  onState((next) => (latest = next));
  await greeted();
  await readPast();
  setInterval(() => {
    const found = latest === null ? null : signals.value;
    samples.push(
      performance.now() / 1000,
      CHANNELS.map((one) => Number(one.read(latest, found) ?? Number.NaN)),
    );
  }, PERIOD);
}
