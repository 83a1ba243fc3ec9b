import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";

type Colours = Record<string, string>;

const css = readFileSync(join(import.meta.dirname, "..", "src", "look", "tokens.css"), "utf-8");

function coloursIn(selector: string): Colours {
  const from = css.indexOf(`${selector} {`);
  const block = css.slice(from, css.indexOf("}", from));
  return Object.fromEntries([...block.matchAll(/--([\w-]+): (#[0-9a-f]{6});/g)].map((one) => [one[1], one[2]]));
}

const dark = coloursIn(":root");
const THEMES: Record<string, Colours> = { dark, light: { ...dark, ...coloursIn(':root[data-theme="light"]') } };

function luminance(colour: string): number {
  const linear = [1, 3, 5].map((at) => {
    const part = parseInt(colour.slice(at, at + 2), 16) / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * linear[0]! + 0.7152 * linear[1]! + 0.0722 * linear[2]!;
}

/** Returns the contrast of two colours as WCAG 2.2 defines it, from 1 to 21. */
function contrast(one: string, other: string): number {
  const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b) as [number, number];
  return (high + 0.05) / (low + 0.05);
}

const GROUNDS = ["bg", "surface", "raised"];
const TEXTS = ["ink", "ink-2", "ink-3", "accent", "ok", "warn", "bad", "c1", "c2", "c3"];

/** Text and what it stands on. */
const PAIRS = [
  ...TEXTS.flatMap((text) => GROUNDS.map((ground) => [text, ground])),
  ...["ok", "warn", "bad", "accent"].flatMap((kind) => [[kind, `${kind}-soft`], ["ink", `${kind}-soft`]]),
  ["on-accent", "accent"],
  ["on-stop", "stop"],
] as [string, string][];

describe.each(Object.entries(THEMES))("the %s theme", (_, theme) => {
  it("changes every colour that the other one has", () => expect(Object.keys(theme).length).toBeGreaterThan(25));

  it.each(PAIRS)("shows %s on %s so that it can be read", (text, ground) => {
    expect(contrast(theme[text]!, theme[ground]!)).toBeGreaterThanOrEqual(4.5);
  });

  it.each(["bg", "surface"])("shows the borders of controls on %s", (ground) => {
    expect(contrast(theme["line-strong"]!, theme[ground]!)).toBeGreaterThanOrEqual(3);
  });

  it.each(["bg", "surface"])("shows stop on %s", (ground) => {
    expect(contrast(theme["stop"]!, theme[ground]!)).toBeGreaterThanOrEqual(3);
  });
});

it("knows black on white", () => expect(contrast("#000000", "#ffffff")).toBeCloseTo(21));
