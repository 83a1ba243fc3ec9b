import { describe, expect, it } from "vitest";
import { around, drawn, extent, forbidden, isAt, middleOf, moved, outlineOf, placed, polar, sector, tickStep, ticks, viewBox, type Zone } from "../src/machine/plan.ts";

const BOX: Zone = { name: "post", kind: "box", low: [0.1, 1.0, 0.0], high: [0.3, 1.5, 0.6], margin: 0.05, lines: true };
const POLE: Zone = { name: "pole", kind: "cylinder", x: 0.5, y: 0.6, radius: 0.1, low: 0, high: 1, margin: 0.05, lines: true };
const WALL = { name: "wall", kind: "half_space", point: [1, 0, 0], normal: [-2, 0, 0], margin: 0.05, lines: false } as const;
const VIEW = { low: [0, 0], high: [2, 1] } as const;

describe("the projection", () => {
  it("has y up and mm", () => expect(drawn([0.5, 1.1])).toEqual([500, -1100]));
  it("returns from the drawing to the same place", () => expect(placed(...drawn([0.523, -1.101]))).toEqual([0.523, -1.101]));
  it("has no negative zero", () => expect(Object.is(placed(0, 0)[1], 0)).toBe(true));
  it("turns the boom from y towards x", () => {
    expect(polar(2, 0)).toEqual([0, 2]);
    expect(polar(2, Math.PI / 2)[0]).toBeCloseTo(2);
  });
});

describe("the extent", () => {
  it("holds the whole range of the boom and axis a", () => {
    const found = extent([0, (2 * Math.PI) / 3], 2, 0);
    expect(found.low[0]).toBeCloseTo(0);
    expect(found.low[1]).toBeCloseTo(-1);
    expect(found.high[0]).toBeCloseTo(2);
    expect(found.high[1]).toBeCloseTo(2);
  });
  it("holds all points with a border", () => expect(around([[0, 1], [2, -1]], 0.5)).toEqual({ low: [-0.5, -1.5], high: [2.5, 1.5] }));
  it("becomes a view box with y down", () => expect(viewBox({ low: [-0.1, -1], high: [2, 2.3] })).toBe("-100 -2300 2100 3300"));
});

describe("the axes", () => {
  it("have values with room between them", () => expect([0.05, 0.125, 0.3, 2].map(tickStep)).toEqual([2, 0.5, 0.2, 0.1]));
  it("have whole multiples of the step", () => {
    expect(ticks(-0.28, 1.1, 0.5)).toEqual([0, 0.5, 1]);
    expect(ticks(-0.52, 0.33, 0.1)).toEqual([-0.5, -0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3]);
  });
});

describe("a ring", () => {
  it("is drawn from the near edge outwards and back", () => {
    const path = sector([0.5, 1], [0, Math.PI / 2]);
    expect(path).toBe("M 0.0 -500.0 L 0.0 -1000.0 A 1000.0 1000.0 0 0 1 1000.0 -0.0 L 500.0 -0.0 A 500.0 500.0 0 0 0 0.0 -500.0 Z");
  });
  it("takes the long way beyond half a turn", () => expect(sector([0.5, 1], [0, 4])).toContain(" 0 1 1 "));
});

describe("zones", () => {
  it("are at the heights between bottom and top, with their margin", () => {
    expect([-0.06, -0.05, 0.3, 0.65, 0.66].map((z) => isAt(BOX, z))).toEqual([false, true, true, true, false]);
    expect(isAt(POLE, 1.04)).toBe(true);
  });
  it("grow by their margin", () => {
    expect(outlineOf(BOX, 0, VIEW)).toBe("M 100.0 -1000.0 L 300.0 -1000.0 L 300.0 -1500.0 L 100.0 -1500.0 Z");
    expect(outlineOf(BOX, 0, VIEW, 0.05)).toContain("M 50.0 -950.0");
  });
  it("of a half-space forbid the side that the normal points out of", () => {
    expect(forbidden(WALL as unknown as Extract<Zone, { kind: "half_space" }>, 0.4, VIEW)).toEqual([[1, 0], [2, 0], [2, 1], [1, 1]]);
  });
  it("of a level half-space fill the view or nothing", () => {
    const floor = { ...WALL, point: [0, 0, 0.2], normal: [0, 0, 1] } as unknown as Extract<Zone, { kind: "half_space" }>;
    expect(forbidden(floor, 0.1, VIEW)).toHaveLength(4);
    expect(outlineOf(floor, 0.3, VIEW)).toBe("");
  });
  it("keep their size when they are moved", () => {
    const box = moved(BOX, 0.1004, -0.2);
    expect([box.low, box.high]).toEqual([[0.2, 0.8, 0], [0.4, 1.3, 0.6]]);
    expect(middleOf(moved(POLE, 0.5, 0))).toEqual([1, 0.6]);
    expect(moved(POLE, 0, 0, 0.25)).toMatchObject({ x: 0.5, y: 0.6, low: 0.25, high: 1.25 });
    expect(moved({ ...BOX, low: [0.1, 1, 0.0004] }, 0.1, 0)).toMatchObject({ low: [0.2, 1, 0.0004] }); // no axis but x changes
  });
});
