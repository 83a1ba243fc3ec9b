import { ref } from "vue";
import { overHttp } from "../api/ask.ts";
import { dropLease } from "../api/lease.ts";
import { keepToken } from "../api/session.ts";
import type { NewToken, Removed } from "../generated/api.ts";
import { failureOf, type Failure } from "./act.ts";
import { me } from "./can.ts";
import { CODE_START, codeIn, exchange } from "./phone.ts";
import { connection, stream } from "./robot.ts";

/** Whether a person asked for the form to sign in; it also shows when the service asks for a token. */
export const signingIn = ref(false);

/** Why the code of a phone did not sign it in. */
export const codeFailure = ref<Failure | null>(null);

/** Connects as the owner of a token, or as nobody. The page keeps its state. */
export function become(token: string): void {
  keepToken(token);
  dropLease();
  signingIn.value = false;
  codeFailure.value = null;
  connection.value = "opening";
  stream.reopen();
}

/** Signs in by name and password. These requests go over HTTP: the stream may be closed. */
export async function signIn(name: string, password: string): Promise<void> {
  const made = (await overHttp("POST", "/v1/session", JSON.stringify({ name, password }))) as NewToken;
  become(made.token);
}

/** Signs in by a token. */
export async function signInWith(token: string): Promise<void> {
  await overHttp("GET", "/v1/me", "", false, token);
  become(token);
}

/** Ends the session: its token is revoked. */
export async function signOut(): Promise<void> {
  (await overHttp("DELETE", "/v1/session")) as Removed;
  me.value = null;
  become("");
}

/** Returns the token of a sign-in address, "" for another one, and removes it from the address and the history. */
export function takeCode(): string {
  const found = codeIn(location.hash);
  if (location.hash.startsWith(CODE_START)) history.replaceState(null, "", location.pathname + location.search);
  return found;
}

/** Signs in by the token of a code. */
export async function redeem(code: string): Promise<void> {
  try {
    await exchange(code, (method, path, body, bearer) => overHttp(method, path, body, false, bearer), keepToken);
  } catch (error) {
    codeFailure.value = failureOf(error);
  }
}
