import type { Operations } from "../generated/api.ts";
import { stream } from "../state/robot.ts";
import { Refusal, refusalOf, Unreachable, type OperationName } from "../stream/stream.ts";
import { language } from "../words/index.ts";
import { leaseId } from "./lease.ts";
import { Keys } from "./once.ts";
import { headers, token } from "./session.ts";

type Value = string | number | boolean | readonly (string | number)[] | undefined;

export interface Options<Name extends OperationName> {
  path?: Record<string, string | number>;
  query?: Record<string, Value>;
  body?: Operations[Name]["body"];
  /** The answer is large: it comes over HTTP, so that it delays no state on the stream. */
  large?: boolean;
  /** The idempotency key. */
  key?: string;
}

/** Messages of the stream may have 64 kB; longer requests go over HTTP. */
const LONGEST_MESSAGE = 60_000;

/**
 * Carries out an operation of the HTTP interface, such as "GET /v1/jobs/{job}", and returns its answer.
 *
 * Requests travel on the stream: they keep their order, and none waits for a free connection of the browser. Throws
 * `Refusal` with the service's sentence, and `Unreachable` without a connection.
 */
export async function ask<Name extends OperationName>(
  name: Name,
  options: Options<Name> = {},
): Promise<Operations[Name]["answer"]> {
  const [method, template] = name.split(" ") as [string, string];
  const target = filled(template, options.path) + queried(options.query);
  const text = options.body === undefined ? "" : JSON.stringify(options.body);
  if (!options.large && stream.ready && text.length < LONGEST_MESSAGE) {
    return (await stream.request(method, target, options.body, leaseId.value, options.key)) as Operations[Name]["answer"];
  }
  return (await overHttp(method, target, text, false, token.value, options.key)) as Operations[Name]["answer"];
}

const keys = new Keys();

/** As `ask`, for what must not be done twice: when it is asked again because the answer was lost, the service knows it. */
export function askOnce<Name extends OperationName>(name: Name, options: Options<Name>): Promise<Operations[Name]["answer"]> {
  return keys.use(JSON.stringify([name, options]), (key) => ask(name, { ...options, key }));
}

/** Fetches a file over HTTP and offers it for download: its token cannot be part of a link. */
export async function download(target: string, name: string, method = "GET"): Promise<void> {
  const answer = await fetched(target, { method, headers: headers(language.value) });
  save(await answer.blob(), name);
}

/** Offers data of the page as a file for download. */
export function save(data: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(data);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Carries out a request over HTTP, by default with the token of this tab. The lease of this tab belongs to that token. */
export async function overHttp(method: string, target: string, text = "", keepalive = false, bearer = token.value, key = ""): Promise<unknown> {
  const sent = headers(language.value, bearer === token.value ? leaseId.value : "", bearer);
  if (key) sent["Idempotency-Key"] = key;
  if (text) sent["Content-Type"] = "application/json";
  const answer = await fetched(target, { method, headers: sent, keepalive, ...(text ? { body: text } : {}) });
  return await answer.json();
}

async function fetched(target: string, request: RequestInit): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(target, { ...request, credentials: "omit", cache: "no-store" });
  } catch {
    throw new Unreachable();
  }
  if (!answer.ok) {
    const body: unknown = await answer.json().catch(() => null);
    throw refusalOf(body, answer.status);
  }
  return answer;
}

/** Returns the template with its parts filled in, percent-encoded. */
export function filled(template: string, path: Record<string, string | number> = {}): string {
  return template.replace(/\{(\w+)\}/g, (_, key: string) => encodeURIComponent(String(path[key] ?? "")));
}

/** Returns the query of a request, "" for none; undefined values are left out. */
function queried(query: Record<string, Value> = {}): string {
  const found = new URLSearchParams();
  for (const [key, value] of Object.entries(query)) {
    for (const one of Array.isArray(value) ? value : [value]) {
      if (one !== undefined) found.append(key, String(one));
    }
  }
  const text = found.toString();
  return text && `?${text}`;
}

export { Refusal, Unreachable };
