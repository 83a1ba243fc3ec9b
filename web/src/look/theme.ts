import { ref } from "vue";

const KEY = "maya.theme";

function initial(): "dark" | "light" {
  return localStorage.getItem(KEY) === "light" ? "light" : "dark";
}

export const theme = ref(initial());

export function setTheme(next: "dark" | "light"): void {
  theme.value = next;
  localStorage.setItem(KEY, next);
  apply();
}

export function apply(): void {
  document.documentElement.dataset["theme"] = theme.value;
}

/** Returns the value of a token of tokens.css in the present theme, for drawings that are not CSS. */
export function token(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
