import { describe, expect, it } from "vitest";
import errors from "../src/generated/errors.json";
import events from "../src/generated/events.json";
import { filledIn, inLanguage, type Sentence } from "../src/words/sentences.ts";

const SENTENCES = errors as unknown as Record<string, Sentence>;
const LIMIT: Sentence = {
  words: ["Axis {axis} met its {side} switch.", "El eje {axis} tocó su interruptor {side}."],
  details: { side: { forward: "positivo" } },
};

describe("a sentence of the service", () => {
  it("is translated with its details, and words of a list as well", () => {
    expect(inLanguage(LIMIT, "Axis b met its forward switch.", "es")).toBe("El eje b tocó su interruptor positivo.");
  });

  it("is translated back, for an English page in a Spanish browser", () => {
    expect(inLanguage(LIMIT, "El eje b tocó su interruptor positivo.", "en")).toBe("Axis b met its forward switch.");
  });

  it("stays as it is if it is in the language already, or unknown", () => {
    expect(inLanguage(LIMIT, "El eje b tocó su interruptor positivo.", "es")).toBe("El eje b tocó su interruptor positivo.");
    expect(inLanguage(LIMIT, "Something else.", "es")).toBe("Something else.");
  });

  it("may contain signs of regular expressions, several lines and the same detail twice", () => {
    const twice: Sentence = { words: ["{a} (*) {b}: {a}?", "¿{a} o {b}?"] };
    expect(inLanguage(twice, "x\ny (*) z: x\ny?", "es")).toBe("¿x\ny o z?");
    expect(inLanguage(twice, "x (*) z: y?", "es")).toBe("x (*) z: y?");
  });

  it("of every declared error comes back the same from Spanish", () => {
    for (const [code, one] of Object.entries(SENTENCES)) {
      const english = one.words[0].replace(/\{(\w+)\}/g, (_, name: string) => `<${name}>`);
      expect(inLanguage(one, inLanguage(one, english, "es"), "en"), code).toBe(english);
      expect(inLanguage(one, english, "es"), code).not.toBe(english);
    }
  });
});

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
