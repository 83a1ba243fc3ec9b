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

/** How eyes without one kind of cones see linear red, green and blue (Machado, Oliveira and Fernandes, 2009). */
const EYES: Record<string, number[][]> = {
  "all cones": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  "no long cones": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
  "no medium cones": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
  "no short cones": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
};

/** Returns a colour as these eyes see it, in OKLab (Ottosson, 2020): 1 is the distance of black and white. */
function seen(colour: string, eyes: number[][]): number[] {
  const by = (rows: number[][], values: number[]) => rows.map((row) => row.reduce((sum, factor, i) => sum + factor * values[i]!, 0));
  const linear = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255).map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
  const cones = by([[0.41222, 0.53633, 0.05145], [0.2119, 0.6807, 0.1074], [0.0883, 0.28172, 0.62998]], by(eyes, linear).map((part) => Math.min(1, Math.max(0, part))));
  return by([[0.21045, 0.79362, -0.00407], [1.978, -2.42859, 0.45059], [0.0259, 0.78277, -0.80868]], cones.map(Math.cbrt));
}

function distance(one: string, other: string, eyes: number[][]): number {
  const [from, to] = [seen(one, eyes), seen(other, eyes)];
  return Math.hypot(...from.map((part, i) => part - to[i]!));
}

describe.each(Object.entries(THEMES))("the colours of axes in the %s theme", (_, theme) => {
  it.each(Object.entries(EYES))("differ for eyes with %s", (_name, eyes) => {
    for (const [one, other] of [["c1", "c2"], ["c1", "c3"], ["c2", "c3"]]) expect(distance(theme[one!]!, theme[other!]!, eyes), `${one} ${other}`).toBeGreaterThan(0.13);
  });

  it.each(["ok", "warn", "bad", "accent"])("are not that of the state %s", (state) => {
    for (const axis of ["c1", "c2", "c3"]) expect(distance(theme[axis]!, theme[state]!, EYES["all cones"]!), axis).toBeGreaterThan(0.11);
  });
});
