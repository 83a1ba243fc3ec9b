import { describe, expect, it } from "vitest";
import events from "../src/generated/events.json";
import { filledIn } from "../src/words/index.ts";

describe("a sentence of an event", () => {
  it("shows shares in percent and other values as they are", () => {
    expect(filledIn("speed {ratio:.0%}", { ratio: 0.5 })).toBe("speed 50 %");
    expect(filledIn("{index:>4} {step}: {state}", { index: 3, step: "pick cube", state: "done" })).toBe("3 pick cube: done");
  });

  it("asks for no other format than these", () => {
    const formats = Object.values(events).flatMap((one) => one.words.flatMap((words) => [...words.matchAll(/\{\w+:([^}]*)\}/g)].map((found) => found[1])));
    expect(formats.filter((one) => !/^\.\d%$|^>\d+$/.test(one ?? ""))).toEqual([]);
  });
});
