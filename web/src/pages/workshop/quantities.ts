import { angleFactor, angleUnit, lengthFactor, lengthUnit } from "../../look/units.ts";

/** The quantity of a signal decides its unit; signals of a group with the same unit share a plot. */
export type Quantity = "length" | "angle" | "speed" | "angular speed" | "voltage" | "load" | "level";

/** How a quantity is shown: its unit, the factor from SI to it, and the digits of a number. */
export interface Shown {
  unit: string;
  factor: number;
  digits: number;
}

/** Returns how a quantity is shown in the units of the page. */
export function shownAs(quantity: Quantity): Shown {
  const mm = lengthUnit.value === "mm";
  switch (quantity) {
    case "length":
      return { unit: lengthUnit.value, factor: lengthFactor.value, digits: mm ? 2 : 5 };
    case "speed":
      return { unit: `${lengthUnit.value}/s`, factor: lengthFactor.value, digits: mm ? 1 : 4 };
    case "angle":
      return { unit: angleUnit.value, factor: angleFactor.value, digits: mm ? 3 : 5 };
    case "angular speed":
      return { unit: `${angleUnit.value}/s`, factor: angleFactor.value, digits: mm ? 2 : 4 };
    case "voltage":
      return { unit: "V", factor: 1, digits: 3 };
    case "load":
      return { unit: "×", factor: 1, digits: 3 };
    case "level":
      return { unit: "", factor: 1, digits: 0 };
  }
}

/** The SI unit of a quantity, for files. */
export const SI: Record<Quantity, string> = {
  length: "m",
  speed: "m/s",
  angle: "rad",
  "angular speed": "rad/s",
  voltage: "V",
  load: "1",
  level: "1",
};
