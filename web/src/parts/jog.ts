import { computed, shallowRef } from "vue";
import { ask } from "../api/ask.ts";
import { onStop } from "../api/stop.ts";
import type { HeldJog, Jogged } from "../generated/api.ts";
import { failureOf, type Failure } from "../state/act.ts";
import { whyNot } from "../state/can.ts";
import { live, queue, state, stream } from "../state/robot.ts";
import { COMMON } from "../words/common.ts";
import { t } from "../words/index.ts";
import { LIVE } from "../words/live.ts";
import { Hold, type Axis, type Heading, type HoldLink } from "./hold.ts";

export type { Axis, Heading };

/** Whether a job of the queue moves the robot. */
export const jobRuns = computed(() => queue.value?.running != null && queue.value.mode === "running");

/** Why nobody can jog from this page now, "" if it is possible. While the robot moves, the service decides. */
export const jogReason = computed(() => {
  if (!live.value) return t(COMMON.offline);
  if (jobRuns.value) return t(LIVE.whileJob);
  return state.value?.mode === "moving" ? "" : whyNot("jog");
});

/** The limit that ended the latest jog, or why it was refused. */
export const jogEnd = shallowRef<{ reason: string } | null>(null);
export const jogFailure = shallowRef<Failure | null>(null);

/** The hold that jogs now, or that could. The page has one: a new hold ends the one before. */
export const activeHold = shallowRef<Hold | null>(null);

const link: HoldLink = {
  ready: () => stream.ready,
  hold: (heading, press) => ask("POST /v1/jog", { body: { ...heading, hold: true, press } }) as Promise<HeldJog>,
  release: (press) => ask("POST /v1/jog", { body: { hold: false, press } }),
  answered(answer) {
    jogEnd.value = answer.limit ? { reason: answer.reason || answer.limit } : null;
  },
  failed(error) {
    jogFailure.value = failureOf(error);
  },
  ended(hold) {
    if (activeHold.value === hold) activeHold.value = null;
  },
};

let presses = 0;

function newId(): string {
  return `${crypto.getRandomValues(new Uint32Array(1))[0]?.toString(36)}-${++presses}`;
}

function forget(): void {
  jogEnd.value = null;
  jogFailure.value = null;
}

/** Begins a hold, and ends the one before. */
export function beginHold(heading: Heading | null = null): Hold {
  release();
  forget();
  const hold = new Hold(link, newId);
  activeHold.value = hold;
  hold.steer(heading);
  return hold;
}

/** Ends the held jog, if any. */
export function release(): void {
  activeHold.value?.end();
}

/** Jogs by a distance (rad or m), as far as the workspace allows. */
export async function step(axis: Axis, distance: number, speed: number): Promise<void> {
  forget();
  try {
    const answer = (await ask("POST /v1/jog", { body: { axis, distance, speed } })) as Jogged;
    if (answer.limit) jogEnd.value = { reason: answer.reason || answer.limit };
  } catch (error) {
    jogFailure.value = failureOf(error);
  }
}

// A key that never comes up must not keep the robot moving: every way to lose it ends the jog.
onStop(release);
for (const kind of ["blur", "pagehide"] as const) addEventListener(kind, release);
document.addEventListener("visibilitychange", () => document.hidden && release());
