import { afterEach, expect, it, vi } from "vitest";
import { Stream, type StreamHandlers } from "../src/stream/stream.ts";

/** A connection of the browser, whose other end is the test. */
class Socket {
  static readonly OPEN = 1;
  static last: Socket;
  readyState = Socket.OPEN;
  sent: Record<string, unknown>[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((message: { data: string }) => void) | null = null;
  onclose: ((end: { code: number }) => void) | null = null;
  constructor() {
    Socket.last = this;
  }
  send(text: string): void {
    this.sent.push(JSON.parse(text) as Record<string, unknown>);
  }
  close(): void {}
  tell(message: Record<string, unknown>): void {
    this.onmessage?.({ data: JSON.stringify(message) });
  }
}

afterEach(() => vi.unstubAllGlobals());

it("sends the idempotency key of a request, if it has one", async () => {
  vi.useFakeTimers();
  vi.stubGlobal("WebSocket", Socket);
  const stream = new Stream("ws://robot", [], () => ({ token: "", language: "en" }), { hello: () => undefined } as unknown as StreamHandlers);
  stream.open();
  Socket.last.tell({ type: "hello", clock: 0, last_event: 0, run: 1 });
  void stream.request("POST", "/v1/jobs", {}, "", "key 1");
  void stream.request("POST", "/v1/stop");
  expect(Socket.last.sent.filter((one) => one["type"] === "request").map((one) => one["key"])).toEqual(["key 1", undefined]);
  vi.useRealTimers();
});
