import { shallowRef } from "vue";
import { ask } from "../api/ask.ts";
import { onStop } from "../api/stop.ts";
import type { HeldJog, Jogged } from "../generated/api.ts";
import { failureOf, type Failure } from "../state/act.ts";
import { stream } from "../state/robot.ts";

export type Axis = "a" | "b" | "c" | "x" | "y" | "z" | "r";

/** A held jog is repeated at this period; the service ends one that is silent for 0.5 s [ms]. */
const PERIOD = 150;

/** The limit that ended the latest jog, or why it was refused. */
export const jogEnd = shallowRef<{ reason: string } | null>(null);
export const jogFailure = shallowRef<Failure | null>(null);

/**
 * One press of a key: jogs while it is held. Requests go on the stream in their order, with the press's own id, so a
 * late repeat cannot start a motion after the release.
 */
class Press {
  private readonly id = `${crypto.getRandomValues(new Uint32Array(1))[0]?.toString(36)}-${++presses}`;
  private timer: ReturnType<typeof setInterval> | undefined;
  private answered = true;
  private over = false;

  constructor(
    private readonly axis: Axis,
    private readonly direction: 1 | -1,
    private readonly speed: number,
  ) {
    void this.repeat();
    this.timer = setInterval(() => void this.repeat(), PERIOD);
  }

  release(): void {
    if (this.over) return;
    this.over = true;
    clearInterval(this.timer);
    if (!stream.ready) return;
    void ask("POST /v1/jog", { body: { hold: false, press: this.id } }).catch(() => undefined);
  }

  private async repeat(): Promise<void> {
    if (!this.answered || this.over) return; // never more than one request on its way
    if (!stream.ready) {
      this.release();
      return;
    }
    this.answered = false;
    try {
      const body = { axis: this.axis, direction: this.direction, hold: true as const, speed: this.speed, press: this.id };
      const answer = (await ask("POST /v1/jog", { body })) as HeldJog;
      if (answer.limit) jogEnd.value = { reason: answer.reason || answer.limit };
    } catch (error) {
      if (!this.over) jogFailure.value = failureOf(error);
      this.release();
    } finally {
      this.answered = true;
    }
  }
}

let presses = 0;
let held: Press | null = null;

/** Begins to jog; a press before ends. */
export function press(axis: Axis, direction: 1 | -1, speed: number): void {
  release();
  jogEnd.value = null;
  jogFailure.value = null;
  held = new Press(axis, direction, speed);
}

/** Ends the held jog, if any. */
export function release(): void {
  held?.release();
  held = null;
}

/** Jogs by a distance (rad or m), as far as the workspace allows. */
export async function step(axis: Axis, distance: number, speed: number): Promise<void> {
  jogEnd.value = null;
  jogFailure.value = null;
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
