import type { SettingInfo } from "../../generated/api.ts";
import { numberWithin, type Mistake } from "./parameters.ts";

/** A mistake in the text of a setting that the page finds without the service. */
export type TextMistake = Mistake | "not a list";

/** Returns the leaves of a nested configuration by their dotted names; lists are leaves. */
export function flat(config: unknown, prefix = ""): Record<string, unknown> {
  const found: Record<string, unknown> = {};
  for (const [key, value] of Object.entries(config as Record<string, unknown>)) {
    const nested = typeof value === "object" && value !== null && !Array.isArray(value);
    Object.assign(found, nested ? flat(value, `${prefix}${key}.`) : { [prefix + key]: value });
  }
  return found;
}

/** Returns dotted names as nested objects, as a request has them. */
export function nested(values: Readonly<Record<string, unknown>>): Record<string, unknown> {
  const found: Record<string, unknown> = {};
  for (const [name, value] of Object.entries(values)) {
    const keys = name.split(".");
    const last = keys.pop() as string;
    let table = found;
    for (const key of keys) table = (table[key] ??= {}) as Record<string, unknown>;
    table[last] = value;
  }
  return found;
}

/** Returns the text of a value in a field; no value is an empty text. */
export function textOf(value: unknown): string {
  if (value === null || value === undefined) return "";
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}

/** Returns the text of a value beside a field: numbers with six digits. */
export function shortOf(value: unknown): string {
  return typeof value === "number" && !Number.isInteger(value) ? String(Number(value.toPrecision(6))) : textOf(value);
}

/** Returns the value in the text of a field, and what is wrong with the text. */
export function valueOf(setting: SettingInfo, text: string): { value: unknown; mistake: TextMistake } {
  if (setting.optional && text.trim() === "") return { value: null, mistake: "" };
  switch (setting.type) {
    case "boolean":
      return { value: text === "true", mistake: "" };
    case "number":
    case "integer": {
      const [low, high] = rangeOf(setting);
      return numberWithin(text, low, high, setting.type === "integer");
    }
    case "array":
      return listOf(text);
    default:
      return { value: text, mistake: "" };
  }
}

function listOf(text: string): { value: unknown; mistake: TextMistake } {
  try {
    const value: unknown = JSON.parse(text);
    return { value, mistake: Array.isArray(value) ? "" : "not a list" };
  } catch {
    return { value: null, mistake: "not a list" };
  }
}

/** Returns the least and the greatest value of a setting, null for no limit. */
export function rangeOf(setting: SettingInfo): [number | null, number | null] {
  return [setting.minimum ?? setting.exclusive_minimum, setting.maximum ?? setting.exclusive_maximum];
}

/** Whether two values of settings are the same. */
export function same(one: unknown, other: unknown): boolean {
  return one === other || JSON.stringify(one) === JSON.stringify(other);
}

/** Whether the name or a description of a setting contains every word of `text`. */
export function found(setting: SettingInfo, text: string): boolean {
  const searched = [setting.name, setting.unit, ...Object.values(setting.description)].join(" ").toLowerCase();
  return text.toLowerCase().split(/\s+/).every((word) => searched.includes(word));
}
