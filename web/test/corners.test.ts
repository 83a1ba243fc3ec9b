import { describe, expect, it } from "vitest";
import { draftOf, emptyCorner, gridOf, gripsOf, neededCorners, sentCorner, WHOLE, withGripAt, type PalletDraft } from "../src/pages/teach/corners.ts";

describe("the corners of a pallet", () => {
  it("are three or four, and the two ends of a single row or column", () => {
    expect(neededCorners(2, 3, false)).toEqual([0, 1, 2]);
    expect(neededCorners(2, 3, true)).toEqual([0, 1, 2, 3]);
    expect(neededCorners(1, 4, true)).toEqual([0, 1]);
    expect(neededCorners(4, 1, false)).toEqual([0, 2]);
  });
  it("are sent as the name of a pose, or as coordinates with or without z", () => {
    expect(sentCorner({ ...emptyCorner(), pose: "shelf", x: 1 })).toBe("shelf");
    expect(sentCorner({ pose: "", x: 0.9, y: 1, z: null })).toEqual([0.9, 1]);
    expect(sentCorner({ pose: "", x: 0.9, y: 1, z: 0.4 })).toEqual([0.9, 1, 0.4]);
    expect(sentCorner({ pose: "", x: 0.9, y: null, z: 0.4 })).toBeNull();
  });
  it("of a pallet without a valid grid are empty", () => {
    const draft = draftOf({ name: "tray", rows: 2, columns: 3, corners: null, flatness: null, squareness: null, remarks: [], taught: "" });
    expect([draft.replace, draft.corners.map(sentCorner)]).toEqual([true, [null, null, null, null]]);
  });
});

describe("a pallet in the 3D view", () => {
  const known = { poses: [{ name: "shelf", joints: [0, 1, 1] as [number, number, number], point: [0.2, 1, 0.6] as [number, number, number], taught: "" }], height: 0.4 };
  const at = (x: number | null, y: number | null, z: number | null) => ({ pose: "", x, y, z });
  const draft = (change: Partial<PalletDraft> = {}): PalletDraft => ({
    name: "tray", rows: 2, columns: 3, fourth: false, replace: false,
    corners: [at(0.6, 0.9, 0.4), at(0.9, 0.9, 0.4), at(0.6, 0.6, null), emptyCorner()], ...change,
  });

  it("has its fourth corner opposite to the first, unless it is given", () => {
    expect(gridOf(draft(), known)?.corners[3]).toEqual([0.9, 0.6, 0.4].map((one) => expect.closeTo(one, 9)));
    expect(gridOf(draft({ fourth: true }), known)).toBeNull();
    expect(gridOf(draft({ rows: 1 }), known)?.corners).toEqual([[0.6, 0.9, 0.4], [0.9, 0.9, 0.4], [0.6, 0.9, 0.4], [0.9, 0.9, 0.4]]);
  });
  it("is not drawn while a corner or a number is missing", () => {
    expect(gridOf(draft({ rows: null }), known)).toBeNull();
    expect(gridOf(draft({ corners: [at(0.6, null, 0.4), at(0.9, 0.9, 0.4), at(0.6, 0.6, 0.4)] }), known)).toBeNull();
  });
  it("has a grip for each corner that is coordinates, and one in the middle if all are", () => {
    expect(gripsOf(draft(), known).map((one) => one.id)).toEqual([WHOLE, "0", "1", "2"]);
    const named = draft({ corners: [{ ...emptyCorner(), pose: "shelf" }, at(0.9, 0.9, 0.4), at(0.6, 0.6, 0.4)] });
    expect(gripsOf(named, known).map((one) => one.id)).toEqual(["1", "2"]);
    expect(gridOf(named, known)?.corners[0]).toEqual([0.2, 1, 0.6]);
  });
  it("moves as a whole, or at one corner, and keeps what an axis does not change", () => {
    const [middle] = gripsOf(draft(), known);
    const [x, y, z] = middle!.point;
    const whole = withGripAt(draft(), WHOLE, [x + 0.1, y - 0.05, z], known);
    expect(whole.corners.slice(0, 3)).toEqual([at(0.7, 0.85, 0.4), at(1, 0.85, 0.4), at(0.7, 0.55, 0.4)]);
    const corner = withGripAt(draft(), "2", [0.6, 0.6, 0.5], known);
    expect(corner.corners.slice(1, 3)).toEqual([at(0.9, 0.9, 0.4), at(0.6, 0.6, 0.5)]);
  });
});
