import { expect, test, vi } from "vitest";

vi.stubGlobal("localStorage", { getItem: () => null });
const { shortDuration } = await import("../src/words/index.ts");

test.each([
  [0.04, "0.0 s"],
  [0.25, "0.3 s"],
  [9.94, "9.9 s"],
  [9.96, "0:10"],
  [75, "1:15"],
  [null, "–"],
])("a duration of %j s is written as %j", (seconds, text) => expect(shortDuration(seconds)).toBe(text));
