import { ref } from "vue";
import { filled, overHttp } from "../api/ask.ts";
import { dropLease } from "../api/lease.ts";
import { keepToken } from "../api/session.ts";
import type { Me, NewToken, Removed, TokenLine } from "../generated/api.ts";
import { failureOf, type Failure } from "./act.ts";
import { me } from "./can.ts";
import { CODE_START, codeIn, PHONE, stamp } from "./phone.ts";
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

/** Exchanges the token of a code for one of this page that ends with it. So the code works once. */
export async function redeem(code: string): Promise<void> {
  try {
    const caller = (await overHttp("GET", "/v1/me", "", false, code)) as Me;
    const path = filled("/v1/users/{name}/tokens", { name: caller.name });
    const all = (await overHttp("GET", path, "", false, code)) as TokenLine[];
    const expires = all.find((one) => one.id === caller.token)?.expires ?? "";
    const body = JSON.stringify({ note: PHONE, expires: stamp(expires) });
    const own = (await overHttp("POST", path, body, false, code)) as NewToken;
    await overHttp("DELETE", filled("/v1/tokens/{token}", { token: caller.token }), "", false, own.token);
    keepToken(own.token);
  } catch (error) {
    codeFailure.value = failureOf(error);
  }
}
