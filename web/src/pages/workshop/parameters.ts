import type { FaultParameter } from "../../generated/api.ts";
import { numberOf } from "../../look/field.ts";

/** The value of a parameter of a fault. */
export type FaultValue = FaultParameter["default"];

/** The mistake in the text of a number: it is no number, no whole number, or outside its range. */
export type Mistake = "not a number" | "not whole" | "outside" | "";

/** Returns the number in a text, and what is wrong with it. */
export function numberWithin(text: string, low: number | null, high: number | null, whole = false): { value: number; mistake: Mistake } {
  const value = numberOf(text);
  if (value === null) return { value: Number.NaN, mistake: "not a number" };
  if (whole && !Number.isInteger(value)) return { value, mistake: "not whole" };
  const outside = (low !== null && value < low) || (high !== null && value > high);
  return { value, mistake: outside ? "outside" : "" };
}

/** Returns the value of a parameter in the type of its default, and what is wrong with it. */
export function valueOf(parameter: FaultParameter, text: string): { value: FaultValue; mistake: Mistake } {
  if (typeof parameter.default === "boolean") return { value: text === "true", mistake: "" };
  if (typeof parameter.default === "string") return { value: text, mistake: "" };
  return numberWithin(text, parameter.minimum, parameter.maximum);
}
