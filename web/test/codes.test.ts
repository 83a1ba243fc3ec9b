import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import * as codes from "../src/generated/codes.ts";

const SOURCE = join(import.meta.dirname, "..", "src");
const requests: number[] = Object.values(codes).filter((code) => code > codes.FIRST_REQUEST);
const files = readdirSync(SOURCE, { recursive: true, encoding: "utf-8" }).filter((file) => /\.(ts|vue)$/.test(file) && !file.startsWith("generated"));

it.each(files)("%s names errors, and writes no code as a number", (file) => {
  const numbers = readFileSync(join(SOURCE, file), "utf-8").match(/\b\d{4}\b/g) ?? [];
  expect(numbers.map(Number).filter((one) => requests.includes(one))).toEqual([]);
});
