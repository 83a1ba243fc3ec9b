import { describe, expect, it } from "vitest";
import type { JobLine, JobReport, RecordedStates, StepResult, TaskState } from "../src/generated/api.ts";
import { comparisonOf, deviation, difference, percent } from "../src/pages/history/durations.ts";
import { joined, PAGE, queryOf, type Wanted } from "../src/pages/history/paging.ts";
import { roundValues, stepChart } from "../src/pages/history/step-bars.ts";
import { lastUpTo, Track } from "../src/pages/history/track.ts";
import { dateAt } from "../src/pages/history/robot-clock.ts";

function step(index: number, predicted: number | null, duration: number | null, state: TaskState = "done"): StepResult {
  return { index, key: `steps.${index}`, step: "pick cube", state, code: 0, message: "", predicted, duration, end_counts: null, end_point: null, phase: "" };
}

const reportOf = (...steps: StepResult[]) => ({ steps }) as unknown as JobReport;
const lines = (...ids: number[]) => ids.map((id) => ({ id })) as unknown as JobLine[];

describe("predicted against actual", () => {
  it("compares only steps that were both predicted and carried out", () => {
    const report = reportOf(step(1, null, 240), step(2, 10, 11), step(3, 20, 22), step(4, 30, 5, "failed"), step(5, 30, null, "skipped"));
    expect(comparisonOf(report)).toEqual({ predicted: 30, actual: 33 });
    expect(comparisonOf(reportOf(step(1, null, 240)))).toBeNull();
  });

  it("gives the difference in percent with its sign", () => {
    expect(percent(difference(30, 33))).toBe("+10 %");
    expect(percent(difference(30, 27))).toBe("−10 %");
    expect(percent(difference(30, 30.01))).toBe("±0 %");
    expect(percent(difference(0, 30))).toBe("–");
    expect(percent(difference(30, null))).toBe("–");
  });

  it("tells a prediction from the actual time only if they differ", () => {
    expect(deviation({ predicted: 10, actual: 20 })).toBe(1);
    expect(deviation({ predicted: 10, actual: 10.04 })).toBeNull();
    expect(deviation({ predicted: 0.1, actual: 0.3 })).toBeNull();
    expect(deviation(undefined)).toBeNull();
  });
});

describe("the list of jobs", () => {
  const wanted: Wanted = { text: " grid ", owner: "", groups: ["done", "failed"], order: "newest" };

  it("asks for the page beyond the last line, in either order", () => {
    expect(queryOf(wanted)).toEqual({ text: "grid", state: ["done", "failed"], order: "newest", limit: PAGE });
    expect(queryOf(wanted, 12)).toMatchObject({ below: 12 });
    expect(queryOf({ ...wanted, order: "oldest" }, 12)).toMatchObject({ above: 12 });
  });

  it("keeps older pages when the first one is read again, and drops what has left them", () => {
    const first = lines(...Array.from({ length: PAGE }, (_, i) => 200 - i));
    const older = lines(165, 161, 160, 159);
    expect(joined(first, older, "newest").map((one) => one.id).slice(PAGE)).toEqual([160, 159]);
    expect(joined(lines(3, 2), older, "newest").map((one) => one.id)).toEqual([3, 2]);
    const upward = lines(...Array.from({ length: PAGE }, (_, i) => i + 1));
    expect(joined(upward, lines(PAGE, PAGE + 1), "oldest").map((one) => one.id).at(-1)).toBe(PAGE + 1);
  });
});

describe("the chart of steps", () => {
  it("has round values from 0 upwards", () => {
    expect(roundValues(43)).toEqual([0, 20, 40]);
    expect(roundValues(0.9)).toEqual([0, 0.5]);
    expect(roundValues(0)).toEqual([0]);
  });

  it("scales to the predicted steps and cuts a homing of minutes", () => {
    const { bars } = stepChart([step(1, null, 240), step(2, 10, 20), step(3, 20, null, "queued")], 300, 100);
    expect(bars.map((one) => [one.predicted, one.actual, one.cut])).toEqual([[0, 100, true], [50, 100, false], [100, 0, false]]);
    expect(bars.every((one) => one.x >= 0 && one.x + one.width <= 300)).toBe(true);
  });

  it("stands without steps and without durations", () => {
    expect(stepChart([], 300, 100).bars).toEqual([]);
    expect(stepChart([step(1, null, null, "queued")], 300, 100).bars[0]).toMatchObject({ predicted: 0, actual: 0, cut: false });
  });
});

function recorded(columns: Record<string, (number | string | null)[]>): RecordedStates {
  const named = Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, { unit: "", values }]));
  return { begin: 0, end: 9, date: "2026-01-01T00:00:00Z", speed: 1, every: 1, columns: named };
}

const TRACK = new Track(
  recorded({
    time: [1, 1.5, 2, 6],
    mode: ["not_homed", "idle", "moving", "moving"],
    a: [null, 0, 1, 3], b: [null, 1, 2, 3], c: [null, 1, 2, 3],
    x: [null, 0, 1, 3], y: [null, 0, 0, 0], z: [null, 0.5, 0.5, 0.5],
    gripper_closed: [0, 0, 1, 1],
    phase: [null, null, "down", "down"],
    tension_b: [null, 0.4, 0.5, 0.6], tension_c: [null, 0.4, 0.5, 0.6],
  }),
);

describe("a recording", () => {
  it("gives the place between two states, and never runs ahead of it", () => {
    const state = TRACK.at(1.75);
    expect(state).toMatchObject({ mode: "idle", joints: [0.5, 1.5, 1.5], gripper_closed: false, tension: [0.4, 0.4], moving: false });
    expect(state?.velocity).toEqual([0, 0, 0]);
  });

  it("has no place before homing, and joins no states across a gap", () => {
    expect(TRACK.at(1.2)?.point).toBeNull();
    expect(TRACK.at(4)?.joints).toEqual([1, 2, 2]);
    expect(TRACK.at(0)?.mode).toBe("not_homed");
    expect(TRACK.at(99)?.joints).toEqual([3, 3, 3]);
    expect(new Track(recorded({ time: [] })).at(1)).toBeNull();
  });

  it("steps from state to state, also from between two of them", () => {
    expect(TRACK.stepped(1.5, 1)).toBe(2);
    expect(TRACK.stepped(1.5, -1)).toBe(1);
    expect(TRACK.stepped(1.7, -1)).toBe(1.5);
    expect(TRACK.stepped(6, 1)).toBe(6);
    expect(TRACK.stepped(1, -1)).toBe(1);
  });

  it("gives the trace of the last seconds in order, without unknown places", () => {
    expect(TRACK.trace(2, 10)).toEqual([[0, 0, 0.5], [1, 0, 0.5]]);
    expect(TRACK.trace(6, 3)).toEqual([[3, 0, 0.5]]);
  });

  it("is divided into spans of one mode without holes", () => {
    expect(TRACK.spans()).toEqual([
      { mode: "not_homed", from: 1, to: 1.5 },
      { mode: "idle", from: 1.5, to: 2 },
      { mode: "moving", from: 2, to: 6 },
    ]);
  });

  it("finds the last row up to a time", () => {
    const rows = [1, 2, 2, 5];
    expect([0, 1, 2, 4.9, 9].map((time) => lastUpTo(rows, time, (one) => one))).toEqual([-1, 0, 2, 2, 3]);
  });
});

describe("the robot's clock", () => {
  it("is scaled by its speed", () => {
    const clock = { time: 100, date: "2026-01-01T12:00:00Z", speed: 10 };
    expect(dateAt(clock, 50).toISOString()).toBe("2026-01-01T11:59:55.000Z");
  });
});
