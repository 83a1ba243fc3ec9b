import type { HeldJog } from "../generated/api.ts";

export type Axis = "a" | "b" | "c" | "x" | "y" | "z" | "r";

/** Shares of the full speed along x, y and z; the length is at most 1. */
export type Vector = [x: number, y: number, z: number];

/** The direction of a held jog: along an axis at a share of the full speed, or along a vector. */
export type Heading = { axis: Axis; direction: 1 | -1; speed: number } | { vector: Vector };

/** How a hold reaches the service, and functions that it calls. */
export interface HoldLink {
  ready(): boolean;
  hold(heading: Heading, press: string): Promise<HeldJog>;
  release(press: string): Promise<unknown>;
  answered(answer: HeldJog): void;
  failed(error: unknown): void;
  /** The hold has ended, for whatever reason. */
  ended(hold: Hold): void;
}

/** A held jog is repeated at this period; the service ends one that is silent for 0.5 s [ms]. */
export const PERIOD = 150;

/** Closer headings than this share of the full speed are the same. */
const SAME = 0.02;

/**
 * Hold-to-run: from the press of a key, of a stick or of an enabling button to its release.
 *
 * While it has a heading, the robot jogs. Requests go in their order, never two at once, with the id of their press, so
 * a late repeat starts nothing after the release. A hold that has ended, by its person or for another reason, does not
 * begin again: the person must release and press again.
 */
export class Hold {
  private press = "";
  private heading: Heading | null = null;
  private sent: Heading | null = null;
  private answeredAll = true;
  private finished = false;
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(
    private readonly link: HoldLink,
    private readonly newId: () => string,
  ) {}

  get over(): boolean {
    return this.finished;
  }

  /** Jogs where `heading` says from now on; null lets the robot come to rest, and the hold goes on. */
  steer(heading: Heading | null): void {
    if (this.finished) return;
    this.heading = heading;
    if (heading === null) {
      this.letGo();
      return;
    }
    if (this.press === "") {
      this.press = this.newId();
      this.sent = null;
      this.timer = setInterval(() => void this.repeat(), PERIOD);
    }
    if (this.sent === null || !alike(this.sent, heading)) void this.repeat();
  }

  /** Ends the hold, and the jog with it. */
  end(): void {
    if (this.finished) return;
    this.finished = true;
    this.letGo();
    this.link.ended(this);
  }

  private letGo(): void {
    clearInterval(this.timer);
    const { press } = this;
    this.press = "";
    this.sent = null;
    if (press !== "" && this.link.ready()) void this.link.release(press).catch(() => undefined);
  }

  private async repeat(): Promise<void> {
    const { press, heading } = this;
    if (!this.answeredAll || press === "" || heading === null) return; // never more than one request on its way
    if (!this.link.ready()) {
      this.end();
      return;
    }
    this.answeredAll = false;
    this.sent = heading;
    try {
      const answer = await this.link.hold(heading, press);
      if (press === this.press) this.link.answered(answer);
    } catch (error) {
      if (press === this.press) {
        this.link.failed(error);
        this.end();
      }
    } finally {
      this.answeredAll = true;
      this.catchUp();
    }
  }

  /** Sends a heading that changed while the request before was on its way. */
  private catchUp(): void {
    if (this.press === "" || this.heading === null) return;
    if (this.sent === null || !alike(this.sent, this.heading)) void this.repeat();
  }
}

/** Whether two headings need no new request. */
export function alike(one: Heading, other: Heading): boolean {
  if ("vector" in one && "vector" in other) {
    return one.vector.every((share, i) => Math.abs(share - (other.vector[i] ?? 0)) < SAME);
  }
  if ("vector" in one || "vector" in other) return false;
  return one.axis === other.axis && one.direction === other.direction && Math.abs(one.speed - other.speed) < SAME;
}
