import type { Me, NewToken, TokenLine } from "../generated/api.ts";
import { NotFound } from "../generated/codes.ts";
import { Refusal } from "../stream/stream.ts";

/** The beginning of the part of an address that signs a phone in: browsers send no server the part behind the #. */
export const CODE_START = "#sign-in=";

const CODE = /^#sign-in=(maya_[0-9a-f]{8}_[0-9a-f]{48})$/;

/** The note of the token of a phone, and that of a code that no phone has read. */
export const PHONE = "phone";
export const CODE_NOTE = "code for a phone";

/** Returns the address that signs a phone in. */
export function signInAddress(origin: string, token: string): string {
  return `${origin}/${CODE_START}${token}`;
}

/** Returns the token in the last part of such an address, "" if it has none. */
export function codeIn(hash: string): string {
  return CODE.exec(hash)?.[1] ?? "";
}

/** Returns a date as the service reads it, "" for never. */
export function stamp(date: Date | string): string {
  return date === "" ? "" : `${new Date(date).toISOString().slice(0, 19)}Z`;
}

/** Carries out a request with a token. */
export type Send = (method: string, path: string, body: string, bearer: string) => Promise<unknown>;

/**
 * Exchanges the token of a code for one of this page that ends with it. So the code works once. `keep` gets the new token
 * before the code is revoked: if that fails, the token is not lost.
 */
export async function exchange(code: string, send: Send, keep: (token: string) => void): Promise<void> {
  const caller = (await send("GET", "/v1/me", "", code)) as Me;
  const path = `/v1/users/${encodeURIComponent(caller.name)}/tokens`;
  const all = (await send("GET", path, "", code)) as TokenLine[];
  const expires = all.find((one) => one.id === caller.token)?.expires ?? "";
  const own = (await send("POST", path, JSON.stringify({ note: PHONE, expires: stamp(expires) }), code)) as NewToken;
  keep(own.token);
  await revoked(() => send("DELETE", `/v1/tokens/${caller.token}`, "", own.token));
}

/** Waits for the revocation of a token. A token that is not there any more needs none: a phone has used a code up. */
export async function revoked(revoke: () => Promise<unknown>): Promise<void> {
  try {
    await revoke();
  } catch (error) {
    if (!(error instanceof Refusal && error.code === NotFound)) throw error;
  }
}
