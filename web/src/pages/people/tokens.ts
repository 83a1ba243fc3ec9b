import type { Me, TokenLine } from "../../generated/api.ts";
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

/** Returns when a person's own token ends, "" for never: only administrators give tokens that last longer. */
export function limitOf(me: Me | null, tokens: readonly TokenLine[]): string {
  return me?.role === "admin" ? "" : (tokens.find((one) => one.id === me?.token)?.expires ?? "");
}

const LOOPBACK = /^(localhost|127(\.\d+){3}|\[::1\])$/;

/**
 * Returns the origins at which another device reaches this service: that of the page, unless it is this computer's
 * own loopback, and those on which the service listens for others.
 */
export function onOtherComputers(page: string, remote: readonly string[]): string[] {
  const near = LOOPBACK.test(new URL(page).hostname);
  return [...new Set(near ? remote : [page, ...remote])];
}
