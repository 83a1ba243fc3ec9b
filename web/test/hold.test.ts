import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Hold, PERIOD, type Heading, type HoldLink } from "../src/parts/hold.ts";
import type { HeldJog } from "../src/generated/api.ts";

const RIGHT: Heading = { axis: "x", direction: 1, speed: 1 };
const UP: Heading = { axis: "z", direction: 1, speed: 1 };
const MOVING: HeldJog = { axis: "x", direction: 1, moving: true, limit: "", reason: "" } as HeldJog;

/** A service that answers when the test lets it, and keeps the requests. */
class Service implements HoldLink {
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
let hold: Hold;

beforeEach(() => {
  vi.useFakeTimers();
  service = new Service();
  let n = 0;
  hold = new Hold(service, () => `p${++n}`);
});
afterEach(() => vi.useRealTimers());

it("repeats with the same press, and never has two requests on their way", async () => {
  hold.steer(RIGHT);
  await vi.advanceTimersByTimeAsync(PERIOD * 3);
  expect(service.asked).toEqual([[RIGHT, "p1"]]);
  await service.answer();
  await vi.advanceTimersByTimeAsync(PERIOD);
  expect(service.asked).toEqual([[RIGHT, "p1"], [RIGHT, "p1"]]);
});

it("releases its press at its end, and is silent from then on", async () => {
  hold.steer(RIGHT);
  hold.end();
  await service.answer();
  hold.steer(UP);
  await vi.advanceTimersByTimeAsync(PERIOD * 5);
  expect(service.asked).toHaveLength(1);
  expect(service.released).toEqual(["p1"]);
  expect([hold.over, service.endings]).toEqual([true, 1]);
});

it("sends a new heading at once, or as soon as the request before is answered", async () => {
  hold.steer(RIGHT);
  hold.steer(UP);
  expect(service.asked).toHaveLength(1);
  await service.answer();
  expect(service.asked[1]).toEqual([UP, "p1"]);
});

it("sends no more for a heading that hardly changed", async () => {
  hold.steer({ vector: [0.5, 0, 0] });
  await service.answer();
  hold.steer({ vector: [0.51, 0, 0] });
  expect(service.asked).toHaveLength(1);
  hold.steer({ vector: [0.6, 0, 0] });
  expect(service.asked).toHaveLength(2);
});

it("comes to rest and goes on with another press", async () => {
  hold.steer(RIGHT);
  await service.answer();
  hold.steer(null);
  expect(service.released).toEqual(["p1"]);
  await vi.advanceTimersByTimeAsync(PERIOD * 5);
  expect(service.asked).toHaveLength(1);
  hold.steer(UP);
  expect(service.asked[1]).toEqual([UP, "p2"]);
});

it("asks for the new press when the answer to the old one is late", async () => {
  hold.steer(RIGHT);
  hold.steer(null);
  hold.steer(UP);
  expect(service.asked).toHaveLength(1);
  await service.answer();
  expect(service.asked[1]).toEqual([UP, "p2"]);
});

it("ends with a refusal, and reports it", async () => {
  hold.steer(RIGHT);
  await service.refuse();
  expect([hold.over, service.failures.length, service.released]).toEqual([true, 1, ["p1"]]);
});

it("does not report a refusal that comes after the release", async () => {
  hold.steer(RIGHT);
  hold.steer(null);
  await service.refuse();
  expect([hold.over, service.failures.length]).toEqual([false, 0]);
});

it("ends without a connection, and sends nothing", async () => {
  hold.steer(RIGHT);
  await service.answer();
  service.up = false;
  await vi.advanceTimersByTimeAsync(PERIOD);
  expect([hold.over, service.asked.length, service.released]).toEqual([true, 1, []]);
});
