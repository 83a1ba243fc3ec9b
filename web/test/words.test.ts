import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it, vi } from "vitest";
import { NodeTypes, type AttributeNode, type TemplateChildNode } from "@vue/compiler-core";
import { parse } from "vue/compiler-sfc";
import { ICONS } from "../src/look/icon-names.ts";

const SOURCE = join(import.meta.dirname, "..", "src");

/** Names, units and formats that are the same in every language. */
const INTERNATIONAL = new Set(["Maya", "a", "b", "c", "x", "y", "z", "m", "mm", "rad", "s", "ms", "Hz", "V", "N", "kB", "MB", "px", "CSV", "MCAP"]);

/** Attributes that people read or hear. */
const READ = new Set(["alt", "aria-description", "aria-label", "label", "placeholder", "title"]);

/** Names of keys and code are not translated. */
const VERBATIM = new Set(["kbd", "code", "pre"]);

const files = (folder: string): string[] =>
  readdirSync(folder, { withFileTypes: true }).flatMap((one) => (one.isDirectory() ? files(join(folder, one.name)) : join(folder, one.name)));

function foreign(text: string): boolean {
  return (text.match(/\p{Letter}+/gu) ?? []).some((word) => !INTERNATIONAL.has(word));
}

/** Returns the texts of a template that would not be translated. */
function bareTexts(nodes: readonly TemplateChildNode[]): string[] {
  return nodes.flatMap((node) => {
    if (node.type === NodeTypes.TEXT) return foreign(node.content) ? [node.content.trim()] : [];
    if (node.type !== NodeTypes.ELEMENT || VERBATIM.has(node.tag)) return [];
    const read = node.props.filter((one): one is AttributeNode => one.type === NodeTypes.ATTRIBUTE && READ.has(one.name));
    return [...read.map((one) => one.value?.content ?? "").filter(foreign), ...bareTexts(node.children)];
  });
}

function textsOf(source: string): string[] {
  return bareTexts(parse(source).descriptor.template?.ast?.children ?? []);
}

function isPair(value: unknown): value is [string, string] {
  return Array.isArray(value) && value.length === 2 && value.every((one) => typeof one === "string");
}

/** Returns all texts in two languages that a value holds, by their path. */
function pairs(value: unknown, path: string): [path: string, en: string, es: string][] {
  if (isPair(value)) return [[path, ...value]];
  if (typeof value !== "object" || value === null || ![Object.prototype, Array.prototype, null].includes(Object.getPrototypeOf(value))) return [];
  return Object.entries(value).flatMap(([key, one]) => pairs(one, `${path}.${key}`));
}

const gaps = (text: string): string[] => [...text.matchAll(/\{(\w+)\}/g)].map((one) => one[1] as string).sort();

const sources = files(SOURCE).filter((file) => /\.(ts|vue)$/.test(file) && !file.includes("generated")).map((file) => readFileSync(file, "utf-8"));

/** Returns the texts of a table that no source names; a table whose keys are computed is used as a whole. */
function unused(name: string, table: object): string[] {
  const whole = new RegExp(`\\b${name}\\[|\\.\\.\\.${name}\\b|(in|of) ${name}\\b|\\(${name}\\)`);
  if (sources.some((one) => whole.test(one))) return [];
  return Object.keys(table).filter((key) => !sources.some((one) => new RegExp(`\\b${name}\\.${key}\\b`).test(one))).map((key) => `${name}.${key}`);
}

describe("templates", () => {
  it.each(files(SOURCE).filter((file) => file.endsWith(".vue")).map((file) => [file.slice(SOURCE.length + 1), file]))("%s has no bare text", (_, file) => {
    expect(textsOf(readFileSync(file, "utf-8"))).toEqual([]);
  });

  it("are searched in every place where people read", () => {
    const template = `<template><p v-if="a">12 % {{ b }} mm<b title="Later">Now</b><kbd>Esc</kbd></p><input v-else placeholder="Name" value="x1" /></template>`;
    expect(textsOf(template)).toEqual(["Later", "Now", "Name"]);
  });
});

describe("words", async () => {
  vi.stubGlobal("localStorage", { getItem: () => null });
  const modules = await Promise.all(Object.entries(import.meta.glob("../src/words/*.ts")).map(async ([file, load]) => [file, await load()]));
  const all = modules.flatMap(([file, module]) => pairs(module, (file as string).replace("../src/words", "")));

  it("exist", () => expect(all.length).toBeGreaterThan(200));

  it("have a text in both languages", () => {
    expect(all.filter(([, en, es]) => !en.trim() || !es.trim())).toEqual([]);
  });

  it("are all used", () => {
    const tables = modules.flatMap(([, module]) => Object.entries(module as object)).filter(([, value]) => !isPair(value) && pairs(value, "").length > 0);
    expect(tables.flatMap(([name, table]) => unused(name as string, table as object))).toEqual([]);
  });

  it("have the same gaps in both languages", () => {
    expect(all.filter(([, en, es]) => gaps(en).join() !== gaps(es).join())).toEqual([]);
  });
});

it("uses every icon that it takes from lucide", () => {
  const others = sources.filter((one) => !one.includes("export const ICONS"));
  expect(ICONS.filter((icon) => !others.some((one) => one.includes(`"${icon}"`) || one.includes(`'${icon}'`)))).toEqual([]);
});
