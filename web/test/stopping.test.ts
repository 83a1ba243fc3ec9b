import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { PATIENCE, Stopping } from "../src/api/stopping.ts";
import type { State, StopReport } from "../src/generated/api.ts";

const MOVED: StopReport = { was_moving: true, duration: 0.4, distance: [0.1, 0, 0], job: null };
const AT_REST: StopReport = { ...MOVED, was_moving: false, duration: 0 };
const MOVING = { mode: "moving", moving: true } as State;
const BRAKING = { mode: "stopping", moving: true } as State;
const RESTING = { mode: "idle", moving: false } as State;
const reason = () => "it does not answer.";

let state: State | null;
let stopping: Stopping;

beforeEach(() => {
  vi.useFakeTimers();
  state = MOVING;
  stopping = new Stopping(() => state);
});
afterEach(() => vi.useRealTimers());

/** A stop, whose answer comes when the test lets it. */
function sent() {
  let resolve!: (report: StopReport) => void;
  let reject!: (error: Error) => void;
  const way = new Promise<StopReport>((...ends) => ([resolve, reject] = ends));
  return { resolve, reject, ended: stopping.follow([way], reason) };
}

function see(next: State): void {
  state = next;
  stopping.look();
}

it("keeps its sentence until the robot has come to rest and moves again", async () => {
  const stop = sent();
  expect(stopping.stage.value).toBe("sent");
  stop.resolve(MOVED);
  await stop.ended;
  for (const next of [MOVING, BRAKING, RESTING]) {
    see(next);
    expect(stopping.stage.value).toBe("done");
  }
  see(MOVING);
  expect(stopping.stage.value).toBe("idle");
});

it("ends the sentence of a stop at rest with the next motion", async () => {
  state = RESTING;
  const stop = sent();
  stop.resolve(AT_REST);
  await stop.ended;
  expect(stopping.stage.value).toBe("done");
  see(MOVING);
  expect(stopping.stage.value).toBe("idle");
});

it("knows that the robot came to rest before the answer", async () => {
  const stop = sent();
  see(RESTING);
  stop.resolve(MOVED);
  await stop.ended;
  expect(stopping.stage.value).toBe("done");
  see(MOVING);
  expect(stopping.stage.value).toBe("idle");
});

it("replaces the failure when the answer comes late", async () => {
  const stop = sent();
  await vi.advanceTimersByTimeAsync(PATIENCE);
  expect([stopping.stage.value, stopping.failure.value]).toEqual(["failed", reason()]);
  see(RESTING);
  see(MOVING);
  expect(stopping.stage.value).toBe("failed");
  stop.resolve(MOVED);
  await stop.ended;
  expect([stopping.stage.value, stopping.report.value]).toEqual(["done", MOVED]);
});

it("fails when no way reaches the service", async () => {
  const stop = sent();
  stop.reject(new Error("no"));
  await stop.ended;
  expect(stopping.stage.value).toBe("failed");
});

it("lets an older stop change nothing", async () => {
  const first = sent();
  await vi.advanceTimersByTimeAsync(PATIENCE - 1);
  const second = sent();
  await vi.advanceTimersByTimeAsync(1);
  expect(stopping.stage.value).toBe("sent");
  second.resolve(MOVED);
  await second.ended;
  first.reject(new Error("late"));
  await first.ended;
  expect([stopping.stage.value, stopping.report.value]).toEqual(["done", MOVED]);
});
