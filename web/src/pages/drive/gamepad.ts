import type { Vector } from "../../parts/hold.ts";
import { vectorOf } from "./stick.ts";

/** The part of a gamepad that the dashboard reads (the standard layout of browsers). */
export interface Pad {
  readonly connected: boolean;
  readonly timestamp: number;
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly pressed: boolean }[];
}

/** Either shoulder button enables the sticks while it is held; the right button of the four stops. */
const ENABLING = [4, 5];
const STOPPING = 1;

/** A gamepad whose time stands still for longer is dead, or its stick lies still in a corner [ms]. */
export const STALE = 500;

export interface PadReading {
  /** Whether an enabling button is held, in a report that is fresh. */
  enabled: boolean;
  /** The direction of the sticks, null for rest or without an enabling button. */
  vector: Vector | null;
  /** Whether the stop button went down in this report. */
  stop: boolean;
  /** Whether an enabling button is held without effect: nothing new was reported, and it must come up first. */
  stale: boolean;
}

/**
 * Reads a gamepad again and again. A dead gamepad repeats its last report for ever, so a report counts only while its
 * time moves.
 */
export class PadReader {
  private timestamp = Number.NaN;
  private movedAt = Number.NEGATIVE_INFINITY;
  private stopDown = false;
  private spent = false;

  /** Returns the reading of the gamepad at `now` [ms]; null without one. */
  read(pad: Pad | null, now: number): PadReading | null {
    if (pad === null || !pad.connected) {
      this.timestamp = Number.NaN;
      this.movedAt = Number.NEGATIVE_INFINITY;
      this.stopDown = false;
      this.spent = false;
      return null;
    }
    // The first report does not count: it may be the last one of a gamepad that is gone.
    const first = Number.isNaN(this.timestamp);
    if (!first && pad.timestamp !== this.timestamp) this.movedAt = now;
    this.timestamp = pad.timestamp;
    const fresh = now - this.movedAt < STALE;
    const held = ENABLING.some((button) => pad.buttons[button]?.pressed ?? false);
    this.spent = held && (this.spent || !fresh);
    const enabled = held && !this.spent;
    const [x = 0, y = 0, , up = 0] = pad.axes;
    const stopDown = pad.buttons[STOPPING]?.pressed ?? false;
    const stop = stopDown && !this.stopDown && !first;
    this.stopDown = stopDown;
    return { enabled, vector: enabled ? vectorOf([x, 0 - y], 0 - up) : null, stop, stale: this.spent };
  }
}
