import { computed, onMounted, onUnmounted, ref, shallowRef, watch } from "vue";
import { dropLease } from "../api/lease.ts";
import { keepToken, token } from "../api/session.ts";
import type { EventMessage, FleetView, LinkView, MotionView, NearestLimits, Permissions, Point, QueueView, Signals, State, TableView, Topics } from "../generated/api.ts";
import { NotSignedIn } from "../generated/codes.ts";
import { HIDDEN_RATE, RATE, Stream, type Hello } from "../stream/stream.ts";
import { language } from "../words/index.ts";

/** Everything here has one writer, the stream. Objects are shallow: they are replaced, never changed. */
export const state = shallowRef<State | null>(null);
export const queue = shallowRef<QueueView | null>(null);
export const motion = shallowRef<MotionView | null>(null);
export const link = shallowRef<LinkView | null>(null);
export const signals = shallowRef<Signals | null>(null);
export const margins = shallowRef<NearestLimits | null>(null);
/** Which actions this person may do now, and why not the others. */
export const can = shallowRef<Permissions | null>(null);
const tableView = shallowRef<TableView | null>(null);
/** The robots of the broker; null where no part of the page follows them. */
export const fleet = shallowRef<FleetView | null>(null);
export const hello = shallowRef<Hello | null>(null);

/** The newest events, newest last, at most `MOST_EVENTS`. */
export const events = shallowRef<readonly EventMessage[]>([]);
export const MOST_EVENTS = 500;

/** Returns a source for `watch`: the number of the latest event of a kind, or about a job, or both. */
export function latestEvent(of: { kind?: string; job?: number | undefined }): () => number | undefined {
  const fits = (one: EventMessage) => (of.kind === undefined || one.kind === of.kind) && (!("job" in of) || one.detail["job"] === of.job);
  return () => events.value.findLast(fits)?.seq;
}

/** The connection of this page: never made yet, live, lost, or refused because nobody is signed in. */
export const connection = ref<"opening" | "live" | "lost" | "signed out">("opening");
export const lostAt = ref<Date | null>(null);

/** Whether a state has arrived on the present connection: until then the numbers are those of the one before. */
const current = ref(false);

/** When the latest state arrived [ms, performance.now()]. The robot's own clock may be scaled. */
export const arrived = ref(0);

const stateReaders = new Set<(state: State | null) => void>();

/** Calls `reader` for each state, and with null when the connection is lost. Returns the function that ends this. */
export function onState(reader: (state: State | null) => void): () => void {
  stateReaders.add(reader);
  return () => stateReaders.delete(reader);
}

const ALWAYS = { queue, motion, link, signals, margins, table: tableView, can } as const;
const TARGETS = { ...ALWAYS, fleet } as const;

/** The places of the parts on the table by name [m]; null in the gripper, and where the place is unknown. */
export const table = computed<Record<string, Point | null>>(() => tableView.value?.parts ?? {});

function url(): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/v1/stream`;
}

/** Another version of the service than the one that this page came from. */
export const newVersion = ref(false);

/** Whether the robot is a twin; false before the greeting of the service. */
export const twin = computed(() => hello.value?.address === "sim");

/** The speed of the robot's clock; it differs from 1 only on a twin. */
export const clockSpeed = computed(() => hello.value?.speed ?? 1);

/** By this time the clock of the service's computer is ahead of this one [ms]. */
export const clockAhead = ref(0);

/** The number of times that the service was found restarted. */
export const restarts = ref(0);

export const stream = new Stream(url(), Object.keys(ALWAYS) as (keyof Topics)[], () => ({ token: token.value, language: language.value }), {
  hello(greeting) {
    const before = hello.value;
    newVersion.value ||= before !== null && before.version !== greeting.version;
    if (before !== null && before.run !== greeting.run) {
      restarts.value += 1;
      dropLease();
    }
    hello.value = greeting;
    clockAhead.value = Date.parse(greeting.date) - Date.now();
    connection.value = "live";
    lostAt.value = null;
  },
  state(next) {
    state.value = next;
    current.value = true;
    arrived.value = performance.now();
    for (const reader of stateReaders) reader(next);
  },
  event(event) {
    const all = [...events.value, event];
    events.value = all.length > MOST_EVENTS ? all.slice(-MOST_EVENTS) : all;
  },
  restart() {
    events.value = [];
  },
  topic(name, value) {
    (TARGETS[name as keyof typeof TARGETS] as { value: unknown }).value = value;
  },
  lost(code) {
    dropLease();
    current.value = false;
    for (const reader of stateReaders) reader(null);
    if (code === NotSignedIn) {
      keepToken("");
      connection.value = "signed out";
      return;
    }
    if (connection.value === "live") lostAt.value = new Date();
    connection.value = "lost";
  },
});

watch(language, () => stream.changeLanguage());

/** Follows the fleet while the calling component is shown: with many robots its messages are long. */
export function useFleet(): void {
  onMounted(() => stream.follow("fleet", true));
  onUnmounted(() => {
    stream.follow("fleet", false);
    fleet.value = null;
  });
}

/** Whether the numbers on the page are those of now. */
export const live = computed(() => connection.value === "live" && current.value && state.value !== null);

/** Whether an axis moves. */
export const moving = computed(() => state.value !== null && state.value.moving);

/** Connects, and follows the visibility of the page. The connection ends with the page, and held motion with it. */
export function start(): void {
  stream.open();
  document.addEventListener("visibilitychange", () => stream.setRate(document.hidden ? HIDDEN_RATE : RATE));
  addEventListener("pagehide", () => stream.close());
  addEventListener("pageshow", (event) => {
    if (event.persisted) stream.open();
  });
}
