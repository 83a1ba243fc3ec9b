import { describe, expect, it } from "vitest";
import { CLEAR, placed, type Box } from "../src/app/tour-place.ts";

const CARD = { width: 340, height: 220 };
const SCREENS = {
  desktop: { view: { width: 1440, height: 900 }, stop: { left: 1276, top: 7, width: 148, height: 46 } },
  tablet: { view: { width: 820, height: 1180 }, stop: { left: 656, top: 7, width: 148, height: 46 } },
  phone: { view: { width: 390, height: 844 }, stop: { left: 8, top: 701, width: 374, height: 62 } },
};

function distance(one: Box, other: Box): number {
  const across = Math.max(one.left - other.left - other.width, other.left - one.left - one.width, 0);
  const down = Math.max(one.top - other.top - other.height, other.top - one.top - one.height, 0);
  return Math.max(across, down);
}

describe.each(Object.entries(SCREENS))("placed on a %s", (_, { view, stop }) => {
  it("keeps away from stop and in the window, wherever its target is", () => {
    for (let left = 0; left < view.width - 60; left += 37) {
      for (let top = 0; top < view.height - 44; top += 37) {
        const found = placed(CARD, { left, top, width: 60, height: 44 }, stop, view);
        expect(distance(found, stop)).toBeGreaterThanOrEqual(CLEAR);
        expect(found.left).toBeGreaterThanOrEqual(0);
        expect(found.top).toBeGreaterThanOrEqual(0);
        expect(found.left + found.width).toBeLessThanOrEqual(view.width);
        expect(found.top + found.height).toBeLessThanOrEqual(view.height);
      }
    }
  });

  it("stands beside stop without touching it", () => {
    expect(distance(placed(CARD, stop, stop, view), stop)).toBeGreaterThanOrEqual(CLEAR);
  });
});

it("covers no target that leaves room beside it", () => {
  const { view, stop } = SCREENS.desktop;
  const target = { left: 700, top: 400, width: 60, height: 44 };
  expect(distance(placed(CARD, target, stop, view), target)).toBeGreaterThan(0);
});

it("is in the middle without a target", () => {
  const { view, stop } = SCREENS.desktop;
  expect(placed(CARD, null, stop, view)).toMatchObject({ left: 550, top: 340 });
});
