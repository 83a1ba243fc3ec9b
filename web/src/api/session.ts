import { ref } from "vue";

const KEY = "maya.token";

/** The token of this tab. It is never part of a URL, and ends with the tab. */
export const token = ref(sessionStorage.getItem(KEY) ?? "");

export function keepToken(value: string): void {
  token.value = value;
  if (value) sessionStorage.setItem(KEY, value);
  else sessionStorage.removeItem(KEY);
}

/** Returns the headers of a request over HTTP, by default with the token of this tab. */
export function headers(language: string, lease = "", bearer = token.value): Record<string, string> {
  const found: Record<string, string> = { "Accept-Language": language };
  if (bearer) found["Authorization"] = `Bearer ${bearer}`;
  if (lease) found["Maya-Lease"] = lease;
  return found;
}
