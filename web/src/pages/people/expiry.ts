import { stamp } from "../../state/phone.ts";

export const HOUR = 3600;
export const DAY = 24 * HOUR;

/**
 * Returns the date `seconds` from now as the service reads it, but none after `limit`, the end of the own token ("" for
 * none); "" is never.
 */
export function expiry(seconds: number, limit: string, now = Date.now()): string {
  const wanted = seconds > 0 ? now + 1000 * seconds : Infinity;
  const most = limit ? Date.parse(limit) : Infinity;
  const end = Math.min(wanted, most);
  return Number.isFinite(end) ? stamp(new Date(end)) : "";
}
