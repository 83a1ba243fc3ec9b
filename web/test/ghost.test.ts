import { describe, expect, it, vi } from "vitest";
import type { Point } from "../src/generated/api.ts";

vi.stubGlobal("localStorage", { getItem: () => null });
const { goalOf } = await import("../src/scene/ghost.ts");

const DOWN: Point[] = [[0.2, 1, 0.8], [0.5, 1.1, 0.6], [0.5, 1.1, 0.4], [0.5, 1.1, 0.6]];

describe("the ghost", () => {
  it("stands at the target that a pick passes through", () => expect(goalOf({ points: DOWN, target: [0.5, 1.1, 0.4] })).toEqual([0.5, 1.1, 0.4]));
  it("stands at the end of a path that stops before its target", () => expect(goalOf({ points: DOWN.slice(0, 2), target: [0.5, 1.1, 0.4] })).toEqual([0.5, 1.1, 0.6]));
  it("stands at the end of a path to joints", () => expect(goalOf({ points: DOWN, target: [0.4, 1.5, 1.5] })).toEqual([0.5, 1.1, 0.6]));
  it("is not there without a path", () => {
    expect(goalOf({ points: [], target: true })).toBeNull();
    expect(goalOf({ points: [], target: [0.5, 1.1, 0.4] })).toBeNull();
  });
});
