import { ref } from "vue";
import { forTab } from "../state/kept.ts";

const KEY = "maya.token";

/** The token of this tab. It is never part of a URL, and ends with the tab. */
export const token = ref(forTab.get(KEY) ?? "");

export function keepToken(value: string): void {
  token.value = value;
  forTab.set(KEY, value);
}

/** Returns the headers of a request over HTTP, by default with the token of this tab. */
export function headers(language: string, lease = "", bearer = token.value): Record<string, string> {
  const found: Record<string, string> = { "Accept-Language": language };
  if (bearer) found["Authorization"] = `Bearer ${bearer}`;
  if (lease) found["Maya-Lease"] = lease;
  return found;
}
