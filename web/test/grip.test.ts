import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Grip, PERIOD, type Heading, type Wire } from "../src/parts/grip.ts";
import type { HeldJog } from "../src/generated/api.ts";

const RIGHT: Heading = { axis: "x", direction: 1, speed: 1 };
const UP: Heading = { axis: "z", direction: 1, speed: 1 };
const MOVING: HeldJog = { axis: "x", direction: 1, moving: true, limit: "", reason: "" } as HeldJog;

/** A service that answers when the test says so, and notes what it was asked. */
class Service implements Wire {
  asked: [heading: Heading, press: string][] = [];
  released: string[] = [];
  failures: unknown[] = [];
  endings = 0;
  up = true;
  private answers: { resolve(answer: HeldJog): void; reject(error: Error): void }[] = [];

  ready = () => this.up;
  hold(heading: Heading, press: string): Promise<HeldJog> {
    this.asked.push([heading, press]);
    return new Promise((resolve, reject) => this.answers.push({ resolve, reject }));
  }
  release(press: string): Promise<unknown> {
    this.released.push(press);
    return Promise.resolve();
  }
  answered = () => undefined;
  failed = (error: unknown) => void this.failures.push(error);
  ended = () => void this.endings++;

  async answer(): Promise<void> {
    this.answers.shift()?.resolve(MOVING);
    await vi.advanceTimersByTimeAsync(0);
  }
  async refuse(): Promise<void> {
    this.answers.shift()?.reject(new Error("busy"));
    await vi.advanceTimersByTimeAsync(0);
  }
}

let service: Service;
let grip: Grip;

beforeEach(() => {
  vi.useFakeTimers();
  service = new Service();
  let n = 0;
  grip = new Grip(service, () => `p${++n}`);
});
afterEach(() => vi.useRealTimers());

it("repeats with the same press, and never has two requests on their way", async () => {
  grip.steer(RIGHT);
  await vi.advanceTimersByTimeAsync(PERIOD * 3);
  expect(service.asked).toEqual([[RIGHT, "p1"]]);
  await service.answer();
  await vi.advanceTimersByTimeAsync(PERIOD);
  expect(service.asked).toEqual([[RIGHT, "p1"], [RIGHT, "p1"]]);
});

it("releases its press at its end, and is silent from then on", async () => {
  grip.steer(RIGHT);
  grip.end();
  await service.answer();
  grip.steer(UP);
  await vi.advanceTimersByTimeAsync(PERIOD * 5);
  expect(service.asked).toHaveLength(1);
  expect(service.released).toEqual(["p1"]);
  expect([grip.over, service.endings]).toEqual([true, 1]);
});

it("sends a new heading at once, or as soon as the request before is answered", async () => {
  grip.steer(RIGHT);
  grip.steer(UP);
  expect(service.asked).toHaveLength(1);
  await service.answer();
  expect(service.asked[1]).toEqual([UP, "p1"]);
});

it("sends no more for a heading that hardly changed", async () => {
  grip.steer({ vector: [0.5, 0, 0] });
  await service.answer();
  grip.steer({ vector: [0.51, 0, 0] });
  expect(service.asked).toHaveLength(1);
  grip.steer({ vector: [0.6, 0, 0] });
  expect(service.asked).toHaveLength(2);
});

it("comes to rest and goes on with another press", async () => {
  grip.steer(RIGHT);
  await service.answer();
  grip.steer(null);
  expect(service.released).toEqual(["p1"]);
  await vi.advanceTimersByTimeAsync(PERIOD * 5);
  expect(service.asked).toHaveLength(1);
  grip.steer(UP);
  expect(service.asked[1]).toEqual([UP, "p2"]);
});

it("asks for the new press when the answer to the old one is late", async () => {
  grip.steer(RIGHT);
  grip.steer(null);
  grip.steer(UP);
  expect(service.asked).toHaveLength(1);
  await service.answer();
  expect(service.asked[1]).toEqual([UP, "p2"]);
});

it("ends with a refusal, and tells it", async () => {
  grip.steer(RIGHT);
  await service.refuse();
  expect([grip.over, service.failures.length, service.released]).toEqual([true, 1, ["p1"]]);
});

it("says nothing of a refusal that comes after the release", async () => {
  grip.steer(RIGHT);
  grip.steer(null);
  await service.refuse();
  expect([grip.over, service.failures.length]).toEqual([false, 0]);
});

it("ends without a connection, and sends nothing", async () => {
  grip.steer(RIGHT);
  await service.answer();
  service.up = false;
  await vi.advanceTimersByTimeAsync(PERIOD);
  expect([grip.over, service.asked.length, service.released]).toEqual([true, 1, []]);
});
