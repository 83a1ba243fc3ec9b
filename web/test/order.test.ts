import { expect, test } from "vitest";
import { besides, moved, placeAt } from "../src/pages/queue/order.ts";

test.each([
  [0, 2, ["b", "c", "a"]],
  [2, 0, ["c", "a", "b"]],
  [1, 1, ["a", "b", "c"]],
  [0, 9, ["b", "c", "a"]],
  [7, 0, ["a", "b", "c"]],
])("moves the item %i to %i", (from, to, order) => {
  expect(moved(["a", "b", "c"], from, to)).toEqual(order);
});

test("a dragged row stands before the first middle below the pointer", () => {
  const middles = [100, 150, 200, 250];
  expect(placeAt(90, middles, 2)).toBe(0);
  expect(placeAt(120, middles, 2)).toBe(1);
  expect(placeAt(205, middles, 2)).toBe(2);
  expect(placeAt(300, middles, 2)).toBe(3);
  expect(placeAt(300, middles, 0)).toBe(3);
});

test("names the neighbour of a job that has moved", () => {
  expect(besides([4, 5, 6], 0)).toEqual({ before: 5 });
  expect(besides([4, 5, 6], 1)).toEqual({ after: 4 });
  expect(besides([4, 5, 6], 2)).toEqual({ after: 5 });
  expect(besides([4], 0)).toBeNull();
});
