import { describe, expect, it } from "vitest";
import errors from "../src/generated/errors.json";
import events from "../src/generated/events.json";
import phrases from "../src/generated/phrases.json";
import type { Words } from "../src/words/index.ts";
import { filledIn, inLanguage, phraseBook, type Sentence } from "../src/words/sentences.ts";

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

  it("that nearly fits costs little, however long it is", () => {
    const near = `x${" = ".repeat(8000)}${" is not valid: ".repeat(2000)}`;
    const began = performance.now();
    expect(inLanguage(SENTENCES["4001"]!, near, "es")).toBe(near);
    expect(performance.now() - began).toBeLessThan(500);
  });

  it("of every declared error comes back the same from Spanish", () => {
    for (const [code, one] of Object.entries(SENTENCES)) {
      const english = one.words[0].replace(/\{(\w+)\}/g, (_, name: string) => `<${name}>`);
      expect(inLanguage(one, inLanguage(one, english, "es"), "en"), code).toBe(english);
      expect(inLanguage(one, english, "es"), code).not.toBe(english);
    }
  });
});

describe("a phrase of the service", () => {
  const pairs = phrases as unknown as Words[];
  const sentences = Object.values(SENTENCES);
  const spanish = phraseBook(pairs, sentences, "es");
  const english = phraseBook(pairs, sentences, "en");

  it("is translated with its details, also behind a name and in a list", () => {
    expect(spanish("it must be a number between -10 and 10")).toBe("debe ser un número entre -10 y 10");
    expect(spanish("grid: it has more than 5 bytes")).toBe("grid: tiene más de 5 bytes");
    expect(spanish("zero of a, zero of b and length (D)")).toBe("cero de a, cero de b y longitud (D)");
    expect(spanish("it must be an object like {x: 0.5, y: 1.1, z: 0.4}")).toBe("debe ser un objeto como {x: 0.5, y: 1.1, z: 0.4}");
    expect(english("debe ser un número entre -10 y 10")).toBe("it must be a number between -10 and 10");
  });

  it("stays as it is if it is unknown", () => {
    for (const text of ["", "Permission denied", "zero of a, zero of q", ": "]) expect(spanish(text)).toBe(text);
  });

  it("that nearly fits costs little", () => {
    const end = SENTENCES["4044"]!.words[0].split("{error_code}")[1]!;
    const near = `Step ${" of ".repeat(72)}${" failed: ".repeat(32)}${" (".repeat(155)}${end}!`;
    const began = performance.now();
    expect(spanish(near)).toBe(near);
    expect(performance.now() - began).toBeLessThan(500);
  });

  it("is found by its text, whichever it is, and behind a name", () => {
    for (const [from, to] of pairs) {
      const filled = (template: string) => template.replace(/\{(\w+)\}/g, (_, name: string) => `<${name}>`);
      expect(spanish(filled(from))).toBe(filled(to));
      expect(spanish(`grid: ${filled(from)}`)).toBe(`grid: ${filled(to)}`);
    }
  });

  it("may hold the sentence of any error, with the words of its details", () => {
    for (const one of sentences) {
      const text = one.words[0].replace(/\{(\w+)\}/g, (_, name: string) => `<${name}>`);
      expect(spanish(text)).toBe(inLanguage(one, text, "es"));
    }
    expect(spanish("Axis b hit its forward limit switch. Find the cause, then run `maya recover` and `maya home`.")).toContain("final de carrera positivo");
  });

  it("is translated in the sentence of an error, and a sentence in a phrase", () => {
    const invalid = SENTENCES["4001"]!;
    const text = "point = 2 is not valid: it must be a text.";
    expect(inLanguage(invalid, text, "es", spanish)).toBe("point = 2 no es válido: debe ser un texto.");
    expect(inLanguage(invalid, inLanguage(invalid, text, "es", spanish), "en", english)).toBe(text);
    expect(spanish(`the two together are too much (${text})`)).toBe("los dos juntos son demasiado (point = 2 no es válido: debe ser un texto.)");
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
