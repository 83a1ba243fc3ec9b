import { computed, ref } from "vue";
import { forBrowser } from "../state/kept.ts";
import { locale } from "../words/index.ts";

const KEY = "maya.units";

/** Units of lengths and angles on the page; messages are always in m and rad. */
export const units = ref<"mm" | "si">(forBrowser.get(KEY) === "si" ? "si" : "mm");

export function swapUnits(): void {
  units.value = units.value === "mm" ? "si" : "mm";
  forBrowser.set(KEY, units.value);
}

export const lengthUnit = computed(() => (units.value === "mm" ? "mm" : "m"));
export const angleUnit = computed(() => (units.value === "mm" ? "°" : "rad"));

export const DEGREES = 180 / Math.PI;

/** Factors from m and rad to the units of the page. */
export const lengthFactor = computed(() => (units.value === "mm" ? 1000 : 1));
export const angleFactor = computed(() => (units.value === "mm" ? DEGREES : 1));

/** Returns a number with fixed digits in the page's language; "–" if it is unknown. */
export function fixed(value: number | null | undefined, digits: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value.toLocaleString(locale.value, {
    minimumFractionDigits: digits,
    maximumFractionDigits: digits,
    useGrouping: false,
  });
}

/** Returns a length [m] as a number in the page's unit, with `finer` digits more than usual. */
export function length(metres: number | null | undefined, finer = 0): string {
  return fixed(metres == null ? null : metres * lengthFactor.value, (units.value === "mm" ? 1 : 4) + finer);
}

/** Returns an angle [rad] as a number in the page's unit. */
export function angle(radians: number | null | undefined): string {
  return fixed(radians == null ? null : radians * angleFactor.value, units.value === "mm" ? 2 : 4);
}

/** Returns a place [m] as text, like "500.0, 1100.0, 400.0 mm". */
export function place(point: readonly number[] | null | undefined): string {
  return point ? `${point.map((one) => length(one)).join(", ")} ${lengthUnit.value}` : "–";
}
