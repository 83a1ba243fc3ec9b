import { describe, expect, it } from "vitest";
import { draftOf, emptyCorner, neededCorners, sentCorner } from "../src/pages/teach/corners.ts";

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
