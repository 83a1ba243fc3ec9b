import { beforeEach, expect, it } from "vitest";
import { Keys } from "../src/api/once.ts";
import { Refusal, Unreachable } from "../src/stream/stream.ts";

let keys: Keys;
let sent: string[];

beforeEach(() => {
  keys = new Keys();
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

it("takes a new key after a refusal", async () => {
  await send("job 3 again", new Refusal(4002, "invalid"));
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
