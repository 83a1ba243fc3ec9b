import { expect, it } from "vitest";
import type { Samples } from "../src/generated/api.ts";
import { basisOf, holds, type Basis } from "../src/parts/basis.ts";

const BASIS: Basis = { run: 1, places: undefined, zones: 40, closed: false, joints: [0.2, 1.4, 1.5] };

it("holds for a robot at rest, whose encoders tell some counts more or less", () => {
  expect(holds(BASIS, { ...BASIS, joints: [0.2, 1.4001, 1.4999] })).toBe(true);
  expect(holds({ ...BASIS, joints: null }, { ...BASIS, joints: null })).toBe(true);
});

it.each<[name: string, change: Partial<Basis>]>([
  ["the robot was moved", { joints: [0.2, 1.401, 1.5] }],
  ["the robot lost its position", { joints: null }],
  ["a place was taught", { places: 41 }],
  ["a zone was changed", { zones: 41 }],
  ["the gripper was closed", { closed: true }],
  ["the service started again", { run: 2 }],
])("does not hold when %s", (_, change) => {
  expect(holds(BASIS, { ...BASIS, ...change })).toBe(false);
});

it("has the joints from which the service computed the preview", () => {
  const motions = [{ joints: [[0.3, 1.4, 1.5], [0.9, 1.4, 1.5]] }] as unknown as Samples[];
  expect(basisOf({ motions }, BASIS)).toEqual({ ...BASIS, joints: [0.3, 1.4, 1.5] });
  expect(basisOf({ motions: [] }, BASIS)).toEqual(BASIS);
});
