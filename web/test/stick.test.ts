import { describe, expect, it } from "vitest";
import { vectorOfKeys } from "../src/pages/drive/keys.ts";
import { DEAD, deflection, limited, shaped, SLOWEST, vectorOf } from "../src/pages/drive/stick.ts";

describe("a stick", () => {
  it("is at rest in its dead zone", () => {
    expect(shaped(DEAD)).toBe(0);
    expect(vectorOf([0.1, -0.1], 0.14)).toBeNull();
  });
  it("reaches the full speed at the end of its way, in both directions", () => expect([shaped(1), shaped(-1), shaped(3)]).toEqual([1, -1, 1]));
  it("is never slower than the slowest jog, nor slower further out", () => {
    expect(shaped(DEAD + 0.001)).toBe(SLOWEST);
    const ways = Array.from({ length: 50 }, (_, i) => shaped(DEAD + (0.85 * (i + 1)) / 50));
    expect(ways).toEqual([...ways].sort((one, other) => one - other));
  });
  it("keeps its direction in the plane", () => {
    const found = vectorOf([0.3, 0.4], 0);
    expect(found?.[1]).toBeCloseTo((found?.[0] ?? 0) * (4 / 3));
  });
  it("never exceeds the full speed in a corner, alone or with another", () => {
    expect(Math.hypot(...deflection(1, 1))).toBeCloseTo(1);
    expect(Math.hypot(...(vectorOf([1, 1], 1) ?? [0, 0, 0]))).toBeCloseTo(1);
  });
});

describe("the keys", () => {
  it("add up, and opposite ones cancel each other", () => {
    expect(vectorOfKeys(["ArrowRight"], false)).toEqual([1, 0, 0]);
    expect(vectorOfKeys(["ArrowLeft", "ArrowRight"], false)).toBeNull();
    expect(vectorOfKeys([], false)).toBeNull();
    const both = vectorOfKeys(["ArrowUp", "PageDown"], false);
    expect(both?.[1]).toBeCloseTo(Math.SQRT1_2);
    expect(both?.[2]).toBeCloseTo(-Math.SQRT1_2);
  });
  it("are slow with Shift", () => expect(vectorOfKeys(["PageUp"], true)).toEqual([0, 0, 0.25]));
  it("ignore others", () => expect(vectorOfKeys(["a", "Enter"], false)).toBeNull());
});

it("leaves short vectors as they are", () => expect(limited([0.1, 0.2, 0])).toEqual([0.1, 0.2, 0]));
