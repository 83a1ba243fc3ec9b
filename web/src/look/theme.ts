import { ref } from "vue";
import { forBrowser } from "../state/kept.ts";

const KEY = "maya.theme";

function initial(): "dark" | "light" {
  return forBrowser.get(KEY) === "light" ? "light" : "dark";
}

export const theme = ref(initial());

export function swapTheme(): void {
  theme.value = theme.value === "dark" ? "light" : "dark";
  forBrowser.set(KEY, theme.value);
  applyTheme();
}

export function applyTheme(): void {
  document.documentElement.dataset["theme"] = theme.value;
}

/** Returns the value of a token of tokens.css in the present theme, for drawings that are not CSS. */
export function token(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
