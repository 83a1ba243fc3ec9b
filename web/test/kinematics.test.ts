import { describe, expect, it } from "vitest";
import { gripperAt, jointsFor, meeting } from "../src/machine/kinematics.ts";
import type { Point } from "../src/generated/api.ts";

const GEOMETRY = { height: 2.36, length: 2.3, delta: 0.4, gripper_height: 0.2 };

describe("the kinematics of the pictures", () => {
  it.each<Point>([[0.5, 1.1, 0.4], [1.2, -0.3, 0.1], [0, 1.5, 1.2], [0.9, 0.9, 0]])("holds the gripper at %j", (...point) => {
    const found = gripperAt(GEOMETRY, jointsFor(GEOMETRY, point));
    point.forEach((value, i) => expect(found?.[i]).toBeCloseTo(value, 9));
  });
  it("hangs the gripper below the place where the lines meet", () => {
    // A triangle of sides 3, 4, 5 in tenths: the lines meet 0.24 below the anchors, 0.18 from the inner one.
    const geometry = { height: 2, length: 0.9, delta: 0.4, gripper_height: 0.2 };
    const met = meeting(geometry, 0, 0.3, 0.4);
    expect(met?.[0]).toBe(0);
    expect(met?.[1]).toBeCloseTo(0.58, 9);
    expect(met?.[2]).toBeCloseTo(1.76, 9);
    expect(gripperAt(geometry, [0, 0.3, 0.4])?.[2]).toBeCloseTo(1.56, 9);
  });
  it("knows no place for lines that are too short to meet", () => expect(gripperAt(GEOMETRY, [0, 0.5, 0.5])).toBeNull());
});
