import { expect, it } from "vitest";
import { PadReader, STALE, type Pad } from "../src/pages/drive/gamepad.ts";

function pad(timestamp: number, axes: number[], down: number[] = [4]): Pad {
  const buttons = Array.from({ length: 16 }, (_, i) => ({ pressed: down.includes(i) }));
  return { connected: true, timestamp, axes, buttons };
}

it("does not believe the first report, nor one whose time stands still", () => {
  const reader = new PadReader();
  expect(reader.read(pad(10, [1, 0, 0, 0]), 0)).toMatchObject({ enabled: false, vector: null, stale: true });
  reader.read(pad(20, [1, 0, 0, 0], []), 20);
  expect(reader.read(pad(30, [1, 0, 0, 0]), 40)).toMatchObject({ enabled: true, vector: [1, 0, 0], stale: false });
  expect(reader.read(pad(30, [1, 0, 0, 0]), 40 + STALE - 1)?.enabled).toBe(true);
  expect(reader.read(pad(30, [1, 0, 0, 0]), 40 + STALE)).toMatchObject({ enabled: false, vector: null, stale: true });
});

it("needs the enabling button to come up before it believes a gamepad again", () => {
  const reader = new PadReader();
  reader.read(pad(1, [1, 0, 0, 0]), 0);
  expect(reader.read(pad(2, [1, 0, 0, 0]), 16)?.enabled).toBe(false);
  expect(reader.read(pad(3, [1, 0, 0, 0], []), 32)?.stale).toBe(false);
  expect(reader.read(pad(4, [1, 0, 0, 0]), 48)?.enabled).toBe(true);
});

it("needs an enabling button", () => {
  const reader = new PadReader();
  reader.read(pad(1, [0, -1, 0, 0], []), 0);
  expect(reader.read(pad(2, [0, -1, 0, 0], []), 16)).toMatchObject({ enabled: false, vector: null, stale: false });
  expect(reader.read(pad(3, [0, -1, 0, 0], [5]), 32)?.vector).toEqual([0, 1, 0]);
});

it("takes z from the right stick", () => {
  const reader = new PadReader();
  reader.read(pad(1, [0, 0, 0, 0], []), 0);
  expect(reader.read(pad(2, [0, 0, 0.4, 1]), 16)?.vector).toEqual([0, 0, -1]);
});

it("stops once for each press of the stop button, not for one that was down before", () => {
  const reader = new PadReader();
  const stops = [[1], [1], [], [1], [1]].map((down, i) => reader.read(pad(i, [0, 0, 0, 0], down), 16 * i)?.stop);
  expect(stops).toEqual([false, false, false, true, false]);
});

it("forgets a gamepad that is gone", () => {
  const reader = new PadReader();
  reader.read(pad(1, [1, 0, 0, 0]), 0);
  expect(reader.read(null, 16)).toBeNull();
  expect(reader.read(pad(2, [1, 0, 0, 0]), 32)?.enabled).toBe(false);
});
