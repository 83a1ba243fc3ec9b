import { beforeEach, expect, it } from "vitest";
import { KEPT, Keys } from "../src/api/once.ts";
import { KeyReused, RequestLate } from "../src/generated/codes.ts";
import { Refusal, Unreachable } from "../src/stream/stream.ts";

let keys: Keys;
let sent: string[];
let time = 0;

beforeEach(() => {
  keys = new Keys(() => time);
  sent = [];
});

/** Sends a request that ends as `end` says. */
async function send(about: string, end: Error | null = null): Promise<void> {
  const answered = keys.use(about, (key) => {
    sent.push(key);
    return end === null ? Promise.resolve() : Promise.reject(end);
  });
  await (end === null ? answered : expect(answered).rejects.toBe(end));
}

it("keeps the key of a request until it is answered", async () => {
  for (const end of [new Unreachable(), new Unreachable(), null, null]) await send("job 3 again", end);
  expect(sent[1]).toBe(sent[0]);
  expect(sent[2]).toBe(sent[0]);
  expect(sent[3]).not.toBe(sent[0]);
});

it("keeps the key after a refusal, which may come before the service knows the key", async () => {
  for (const end of [new Unreachable(), new Refusal(RequestLate, "late"), null]) await send("job 3 again", end);
  expect(new Set(sent).size).toBe(1);
});

it("takes a new key if the service knows the key from another request", async () => {
  await send("job 3 again", new Refusal(KeyReused, "used"));
  await send("job 3 again");
  expect(new Set(sent).size).toBe(2);
});

it("forgets a key after some minutes: the person then means another job", async () => {
  await send("job 3 again", new Unreachable());
  time += KEPT;
  await send("job 3 again");
  expect(new Set(sent).size).toBe(2);
});

it("has another key for another request", async () => {
  await send("job 3 again", new Unreachable());
  await send("job 4 again");
  await send("job 3 again");
  expect(sent[2]).toBe(sent[0]);
  expect(sent[1]).not.toBe(sent[0]);
});
