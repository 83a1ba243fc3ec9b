import { ref } from "vue";

const KEY = "maya.token";

/** The token of this tab. It is never part of a URL, and ends with the tab. */
export const token = ref(sessionStorage.getItem(KEY) ?? "");

export function keepToken(value: string): void {
  token.value = value;
  if (value) sessionStorage.setItem(KEY, value);
  else sessionStorage.removeItem(KEY);
}

/** Returns the headers of a request over HTTP. */
export function headers(language: string, lease = ""): Record<string, string> {
  const found: Record<string, string> = { "Accept-Language": language };
  if (token.value) found["Authorization"] = `Bearer ${token.value}`;
  if (lease) found["Maya-Lease"] = lease;
  return found;
}
