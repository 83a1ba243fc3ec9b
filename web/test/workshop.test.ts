import { describe, expect, it } from "vitest";
import type { CalibrationPoint, FaultParameter, FoundByDoctor, LogEntry, PointResidual, SettingInfo } from "../src/generated/api.ts";
import { appended, detailed, matching, MOST_ENTRIES } from "../src/pages/workshop/entries.ts";
import { byOutcome } from "../src/pages/workshop/findings.ts";
import { numberWithin, valueOf } from "../src/pages/workshop/parameters.ts";
import { History } from "../src/pages/workshop/history.ts";
import { arrows, factorOf, scale } from "../src/pages/workshop/residuals.ts";
import { flat, found, nested, rangeOf, same, shortOf, valueOf as settingOf } from "../src/pages/workshop/settings.ts";
import { csv, extremes, inside, nearest, pastOf } from "../src/pages/workshop/traces.ts";

const entry = (time: string, text: string, more: Partial<LogEntry> = {}): LogEntry => ({ time, level: "info", kind: "http", text, code: 0, run: 0, seq: 0, ...more });

describe("the log", () => {
  it("replaces the entries of the last date, which were read again", () => {
    const known = [entry("2026-01-01T00:00:01.000Z", "one"), entry("2026-01-01T00:00:02.000Z", "two")];
    const newer = [entry("2026-01-01T00:00:02.000Z", "two"), entry("2026-01-01T00:00:02.000Z", "three"), entry("2026-01-01T00:00:03.000Z", "four")];
    expect(appended(known, newer).map((one) => one.text)).toEqual(["one", "two", "three", "four"]);
  });

  it("stays as it is when nothing is newer", () => {
    const known = [entry("2026-01-01T00:00:01.000Z", "one")];
    expect(appended(known, [])).toEqual(known);
  });

  it("keeps a bounded number of entries, the newest ones", () => {
    const many = Array.from({ length: MOST_ENTRIES + 5 }, (_, i) => entry(`2026-01-01T00:00:00.${String(i).padStart(4, "0")}Z`, String(i)));
    const kept = appended(many.slice(0, 5), many.slice(5));
    expect(kept).toHaveLength(MOST_ENTRIES);
    expect(kept.at(-1)?.text).toBe(String(MOST_ENTRIES + 4));
  });

  it("finds entries that contain every word in the text, the kind or the code", () => {
    const all = [entry("t", "POST /v1/stop 200"), entry("t", "axis b hit its limit", { kind: "events", code: 3002 })];
    expect(matching(all, "STOP")).toEqual([all[0]]);
    expect(matching(all, "events 3002")).toEqual([all[1]]);
    expect(matching(all, "stop events")).toEqual([]);
    expect(matching(all, "  ")).toEqual(all);
  });

  it("writes details as short text", () => {
    expect(detailed({ job: 3, names: ["b", "c"], why: null })).toBe('job 3, names ["b","c"], why null');
    expect(detailed(undefined)).toBe("");
  });
});

describe("the checks", () => {
  it("come by outcome, failures first, each in its order", () => {
    const found = (["ok", "warn", "fail", "warn"] as const).map((outcome, i): FoundByDoctor => ({ check: "disk", outcome, key: String(i), meaning: "", remedy: "", details: {} }));
    expect(byOutcome(found).map(([outcome, of]) => [outcome, of.map((one) => one.key)])).toEqual([["fail", ["2"]], ["warn", ["1", "3"]], ["ok", ["0"]]]);
  });
});

describe("a parameter", () => {
  const number: FaultParameter = { name: "seconds", default: 0.05, unit: "s", words: "", minimum: 0, maximum: 60, choices: [] };

  it("reads numbers with point or comma", () => {
    expect(valueOf(number, " 0,5 ")).toEqual({ value: 0.5, mistake: "" });
    expect(valueOf(number, "1e1")).toEqual({ value: 10, mistake: "" });
  });

  it("names what is wrong with a number", () => {
    expect(valueOf(number, "").mistake).toBe("not a number");
    expect(valueOf(number, "fast").mistake).toBe("not a number");
    expect(valueOf(number, "61").mistake).toBe("outside");
    expect(numberWithin("2.5", null, null, true).mistake).toBe("not whole");
    expect(numberWithin("-5", null, null).mistake).toBe("");
  });

  it("keeps the type of its default", () => {
    expect(valueOf({ ...number, default: true, minimum: null, maximum: null }, "false").value).toBe(false);
    expect(valueOf({ ...number, default: "A", minimum: null, maximum: null }, "B").value).toBe("B");
  });
});

describe("residuals", () => {
  const point = (row: number, x: number, y: number): CalibrationPoint => ({ row, counts: [0, 0, 0], joints: [0, 0, 0], measured: [x, y, 0.5], expected: [x, y, 0.5], off: 0 });
  const residual = (row: number, before: [number, number, number], after: [number, number, number]): PointResidual => ({ row, before, after, used: row !== 4 });
  const residuals = [residual(3, [0.01, 0, 0], [0.001, 0, 0]), residual(5, [0, 0.02, 0], [0, -0.002, 0])];
  const points = [point(3, 1, 2), point(5, 0, 1)];

  it("scales by a round factor so that the longest arrow fits", () => {
    expect(scale([[0.01, 0, 0], [0, 0.02, 1]], 0.3)).toBe(10);
    expect(scale([[0.002, 0, 0]], 0.3)).toBe(100);
    expect(scale([[0, 0, 0.5]], 0.3)).toBe(1);
    expect(scale([[2, 0, 0]], 0.3)).toBe(1);
  });

  it("draws arrows from the measured places, coloured by the same measure before and after", () => {
    const before = arrows(points, residuals, "before", 10, 1);
    expect(before.map((one) => one.to)).toEqual([[1.1, 2], [0, 1.2]]);
    expect(before.map((one) => one.share)).toEqual([0.5, 1]);
    const after = arrows(points, residuals, "after", 100, 1);
    expect(after.map((one) => one.share)).toEqual([0.05, 0.1]);
  });

  it("lets left-out points change neither the factor nor the colours, and cuts their arrows short", () => {
    const all = [...residuals, residual(4, [0, 3, 0], [0, 3, 0])];
    expect(factorOf(all, "before", 0.3)).toBe(factorOf(residuals, "before", 0.3));
    const drawn = arrows([...points, point(4, 0, 0)], all, "before", 10, 0.3);
    expect(drawn.map((one) => one.share)).toEqual([0.5, 1, 1]);
    expect(drawn.map((one) => one.used)).toEqual([true, true, false]);
    expect(drawn[2]?.to[1]).toBeCloseTo(0.3);
    expect(drawn[2]?.size).toBe(3);
  });

  it("leaves out residuals of points that are gone", () => {
    expect(arrows([point(3, 1, 2)], residuals, "after", 1, 1).map((one) => one.row)).toEqual([3]);
  });
});

describe("the traces of the scope", () => {
  const traces = { ages: [-3, -2, -1, 0], columns: [[1, null, 3, 2], [5, 6, 7, 8]] };

  it("counts the samples of a span", () => {
    expect(inside(traces.ages, [-2, -1])).toEqual([1, 3]);
    expect(inside(traces.ages, [-60, 0])).toEqual([0, 4]);
    expect(inside(traces.ages, [1, 2])).toEqual([0, 0]);
  });

  it("finds the least and the greatest known value", () => {
    expect(extremes(traces.columns[0] ?? [], 0, 4)).toEqual([1, 3]);
    expect(extremes(traces.columns[0] ?? [], 1, 2)).toBeNull();
  });

  it("finds the nearest sample", () => {
    expect(nearest(traces.ages, -1.4)).toBe(2);
    expect(nearest([], 0)).toBe(-1);
  });

  it("begins with the states that the service has kept, in real time", () => {
    const past = { end: 100, speed: 5, columns: { time: { values: [90, 95] }, x: { values: [1, null] } } };
    expect(pastOf(past, 10, ["x", null])).toEqual([[8, [1, Number.NaN]], [9, [Number.NaN, Number.NaN]]]);
    expect(pastOf({ ...past, columns: {} }, 10, ["x"])).toEqual([]);
  });

  it("writes a span as CSV, gaps empty and names quoted", () => {
    expect(csv(["x [m]", 'say "y", z'], traces, [-2, -1])).toBe('age [s],x [m],"say ""y"", z"\r\n-2.000,,6\r\n-1.000,3,7\r\n');
  });
});

describe("the terminal's history", () => {
  it("walks back to the oldest command and forward to the text being typed", () => {
    const history = new History();
    for (const one of ["TP", "TP", "TT"]) history.add(one);
    expect([history.back("MG"), history.back("TT"), history.back("TP")]).toEqual(["TT", "TP", "TP"]);
    expect([history.forward("TP"), history.forward("TT"), history.forward("MG")]).toEqual(["TT", "MG", "MG"]);
  });

  it("is empty at first", () => {
    expect(new History().back("T")).toBe("T");
    expect(new History().forward("T")).toBe("T");
  });

  it("begins again at the newest command after one was sent", () => {
    const history = new History();
    history.add("TP");
    history.add("TT");
    history.back("");
    history.back("");
    history.add("TP");
    expect(history.back("")).toBe("TP");
    expect(history.back("")).toBe("TT");
  });
});

describe("a setting", () => {
  const height: SettingInfo = {
    name: "geometry.height", section: "geometry", type: "number", unit: "m", description: { en: "height of the anchors", es: "altura de los anclajes" },
    default: 2.35, optional: false, minimum: null, exclusive_minimum: 0, maximum: 10, exclusive_maximum: null, choices: [], pattern: null,
  };

  it("is a leaf of the nested configuration, and back", () => {
    const config = { geometry: { height: 2.35 }, axes: { a: { letter: "A", jerk_counts: null } }, zones: [] };
    const leaves = { "geometry.height": 2.35, "axes.a.letter": "A", "axes.a.jerk_counts": null, zones: [] };
    expect(flat(config)).toEqual(leaves);
    expect(nested(leaves)).toEqual(config);
  });

  it("is read by its type", () => {
    expect(settingOf(height, "2,36")).toEqual({ value: 2.36, mistake: "" });
    expect(settingOf({ ...height, type: "boolean" }, "true").value).toBe(true);
    expect(settingOf({ ...height, type: "array" }, "[1, 2]").value).toEqual([1, 2]);
    expect(settingOf({ ...height, type: "string" }, "").value).toBe("");
    expect(settingOf({ ...height, optional: true }, " ").value).toBeNull();
  });

  it("names what is wrong with its text", () => {
    expect(settingOf(height, "99").mistake).toBe("outside");
    expect(settingOf(height, "").mistake).toBe("not a number");
    expect(settingOf({ ...height, type: "integer" }, "1.5").mistake).toBe("not whole");
    expect(settingOf({ ...height, type: "array" }, "1, 2").mistake).toBe("not a list");
    expect(settingOf({ ...height, type: "array" }, "3").mistake).toBe("not a list");
  });

  it("has a range of both kinds of limits", () => {
    expect(rangeOf(height)).toEqual([0, 10]);
    expect(rangeOf({ ...height, exclusive_minimum: null, maximum: null })).toEqual([null, null]);
  });

  it("is found by name and by its description in both languages", () => {
    expect(found(height, "GEOMETRY anclajes")).toBe(true);
    expect(found(height, "anchors speed")).toBe(false);
    expect(found(height, "")).toBe(true);
  });

  it("is shown with six digits beside its field", () => {
    expect(shortOf(2.0943951023931953)).toBe("2.0944");
    expect(shortOf(15000000)).toBe("15000000");
    expect(shortOf(null)).toBe("");
  });

  it("is the same when its list is the same", () => {
    expect(same([1, 2], [1, 2])).toBe(true);
    expect(same(null, 0)).toBe(false);
  });
});
