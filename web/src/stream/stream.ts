import type { EventMessage, Operations, State, Topics } from "../generated/api.ts";
import { EventsForgotten, NotSignedIn, RequestLate } from "../generated/codes.ts";

/** A refusal of the service: a stable code, a sentence, and the values in the sentence. */
export class Refusal extends Error {
  constructor(
    readonly code: number,
    message: string,
    readonly details: Record<string, unknown> = {},
    readonly status = 0,
  ) {
    super(message);
    this.name = "Refusal";
  }
}

/** The connection ended before the answer came, or could not be made. */
export class Unreachable extends Error {
  override readonly name = "Unreachable";
}

export interface Hello {
  version: string;
  protocol: number;
  run: number;
  last_event: number;
  robot: string;
  address: string;
  /** The clock of the stream when this message was sent [s]. */
  clock: number;
  /** The speed of the robot's clock; it differs from 1 only on a twin. */
  speed: number;
  /** At this time of the robot's clock [s] the date was `date` (UTC). */
  time: number;
  date: string;
  /** Whether the service watches the robots of a broker. */
  fleet: boolean;
  who: { name: string; role: string };
}

/** Functions that the stream calls for what arrives. `topic` gets the name of a topic and its newest value. */
export interface StreamHandlers {
  hello(hello: Hello): void;
  state(state: State): void;
  event(event: EventMessage): void;
  restart(run: number): void;
  topic<Name extends keyof Topics>(name: Name, value: Topics[Name]): void;
  lost(code: number, refusal: Refusal | null): void;
}

type Message = { type: string; id?: number } & Record<string, unknown>;
type Waiting = { resolve: (answer: Message) => void; reject: (error: Error) => void };

/** The state is sent at the first rate [Hz] while the page is visible, and at the second one while it is hidden. */
export const RATE = 20;
export const HIDDEN_RATE = 1;

/** A connection that is not made within this time is given up and tried again [ms]. */
const OPENING = 5_000;

/** The service sends at least a state every 10 s; a stream that is silent for longer is dead [ms]. */
const SILENCE = 12_000;

/** How often the clock of the stream is asked for [ms]: those of two computers differ by some ms a minute. */
const CLOCK_PERIOD = 60_000;

const FIRST_DELAY = 250;
const LONGEST_DELAY = 4000;

/**
 * The connection to /v1/stream: subscribes, sends requests in order, and connects again after a break.
 *
 * Events continue after the last one seen. A request that waits for its answer when the connection ends is refused with
 * `Unreachable`; it is never sent again, so nothing moves because a connection came back.
 */
export class Stream {
  private socket: WebSocket | null = null;
  private greeted = false;
  private wanted = false;
  private delay = FIRST_DELAY;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private silence: ReturnType<typeof setTimeout> | undefined;
  private lastId = 0;
  private readonly waiting = new Map<number, Waiting>();
  private seen: { run: number; since: number } | null = null;
  private rate = RATE;
  private readonly followed: Set<keyof Topics>;
  private refusal: Refusal | null = null;
  /** The clock of the stream [s] at a time of this page [ms]. */
  private clock = { shows: 0, at: 0 };
  private clockAsked = 0;

  constructor(
    private readonly url: string,
    topics: readonly (keyof Topics)[],
    /** The token of this tab, "" without one, and the language of the page. */
    private readonly reader: () => { token: string; language: string },
    private readonly handlers: StreamHandlers,
  ) {
    this.followed = new Set(topics);
  }

  /** Whether requests can be sent now. */
  get ready(): boolean {
    return this.greeted && this.socket?.readyState === WebSocket.OPEN;
  }

  open(): void {
    this.wanted = true;
    this.connect();
  }

  /** Ends the connection until `open`: held jogs and a bound lease end with it. */
  close(): void {
    this.wanted = false;
    clearTimeout(this.retry);
    this.socket?.close(1000);
  }

  /** Connects again now, for example with another token. The present connection ends without a call of `lost`. */
  reopen(): void {
    clearTimeout(this.retry);
    this.delay = FIRST_DELAY;
    this.wanted = true;
    this.drop();
    this.connect();
  }

  /** Tells the service that the language of the page has changed. */
  changeLanguage(): void {
    if (this.ready) this.introduce();
  }

  /** Changes the rate of states [Hz]. */
  setRate(rate: number): void {
    this.rate = rate;
    if (this.ready) this.send({ type: "subscribe", state: { rate } });
  }

  /** Begins or ends the subscription of a topic, from now on and on later connections. */
  follow(topic: keyof Topics, wanted: boolean): void {
    if (wanted) this.followed.add(topic);
    else this.followed.delete(topic);
    if (this.ready) this.send({ type: "subscribe", [topic]: wanted });
  }

  /**
   * Sends a request of HTTP and returns its answer; throws `Refusal` or `Unreachable`. It says when it was sent: if the
   * connection holds it back, the service does not carry it out later, when this page has given it up. With a key, the
   * service carries it out once, however often it is sent.
   */
  async request(method: string, path: string, body?: unknown, lease?: string, key?: string): Promise<unknown> {
    const message: Message = { type: "request", method, path, sent: this.clock.shows + (performance.now() - this.clock.at) / 1000 };
    if (body !== undefined) message["body"] = body;
    if (lease !== undefined) message["lease"] = lease;
    if (key) message["key"] = key;
    const answer = await this.ask(message);
    const status = answer["status"] as number;
    if (status >= 400) throw refusalOf(answer["body"], status);
    return answer["body"];
  }

  /** Sends a message with an id and returns the message that answers it. */
  ask(message: Message): Promise<Message> {
    if (!this.ready) return Promise.reject(new Unreachable());
    const id = ++this.lastId;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.send({ ...message, id });
    });
  }

  private send(message: Message): void {
    this.socket?.send(JSON.stringify(message));
  }

  private connect(): void {
    if (this.socket !== null || !this.wanted) return;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.greeted = false;
    this.refusal = null;
    this.watchSilence(OPENING);
    socket.onopen = () => {
      this.introduce();
      this.watchSilence();
    };
    socket.onmessage = (message) => this.receive(JSON.parse(message.data as string) as Message);
    socket.onclose = (end) => this.closed(end.code);
  }

  private introduce(): void {
    const { token, language } = this.reader();
    this.send({ type: "hello", protocol: 1, language, ...(token && { token }) });
  }

  /** Gives the connection up if nothing arrives within a time [ms]. */
  private watchSilence(limit = SILENCE): void {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => this.giveUp(), limit);
  }

  private giveUp(): void {
    this.drop();
    this.closed(1006);
  }

  /** Closes the connection without waiting for the closing handshake. */
  private drop(): void {
    const socket = this.socket;
    if (socket !== null) {
      socket.onopen = null;
      socket.onmessage = null;
      socket.onclose = null;
      socket.close(1000);
    }
    this.reset();
  }

  private reset(): void {
    clearTimeout(this.silence);
    this.socket = null;
    this.greeted = false;
    for (const one of this.waiting.values()) one.reject(new Unreachable());
    this.waiting.clear();
  }

  private closed(code: number): void {
    this.reset();
    this.handlers.lost(code, this.refusal);
    const final = code === NotSignedIn; // the token is not valid: the page asks for another one
    if (!this.wanted || final) return;
    this.retry = setTimeout(() => this.connect(), this.delay);
    this.delay = Math.min(this.delay * 2, LONGEST_DELAY);
  }

  /** Ends the request that a message answers. Returns whether there was one. */
  private answered(message: Message): boolean {
    const request = message.id === undefined ? undefined : this.waiting.get(message.id);
    if (request === undefined) return false;
    this.waiting.delete(message.id as number);
    if (message.type === "error") {
      const refusal = refusalOf(message, 0);
      if (refusal.code === RequestLate) this.askClock(); // the clock of this page may have stood still while the computer slept
      request.reject(refusal);
    } else {
      request.resolve(message);
    }
    return true;
  }

  private setClock(message: Message): void {
    this.clock = { shows: message["clock"] as number, at: performance.now() };
    this.clockAsked = this.clock.at;
  }

  private askClock(): void {
    this.clockAsked = performance.now();
    this.send({ type: "ping" });
  }

  private receive(message: Message): void {
    this.watchSilence();
    if (this.greeted && performance.now() - this.clockAsked > CLOCK_PERIOD) this.askClock();
    if (this.answered(message)) return;
    switch (message.type) {
      case "hello":
        this.setClock(message);
        this.greet(message as unknown as Hello);
        break;
      case "pong":
        this.setClock(message);
        break;
      case "state":
        this.handlers.state(message["state"] as State);
        break;
      case "event": {
        const event = message["event"] as EventMessage;
        this.seen = { run: message["run"] as number, since: event.seq };
        this.handlers.event(event);
        break;
      }
      case "restart":
        this.seen = { run: message["run"] as number, since: 0 };
        this.handlers.restart(message["run"] as number);
        break;
      case "error":
        this.refusal = refusalOf(message, 0);
        if (this.refusal.code === EventsForgotten) this.skipPast(message);
        break;
      default:
        if ((this.followed as Set<string>).has(message.type)) {
          const name = message.type as keyof Topics;
          this.handlers.topic(name, message[name] as Topics[typeof name]);
        }
    }
  }

  /** Subscribes after the first greeting. The service greets callers without a token at once, and everybody after each `hello`. */
  private greet(hello: Hello): void {
    if (this.greeted) return;
    this.greeted = true;
    this.delay = FIRST_DELAY;
    const events = this.seen ?? { since: Math.max(0, hello.last_event - 200), run: hello.run };
    const subscription: Message = { type: "subscribe", state: { rate: this.rate }, events };
    for (const topic of this.followed) subscription[topic] = true;
    this.send(subscription);
    this.handlers.hello(hello);
  }

  /** Continues with the oldest event that the service still has. */
  private skipPast(message: Message): void {
    const details = message["details"] as { oldest?: number } | undefined;
    const since = Math.max(0, (details?.oldest ?? 1) - 1);
    this.send({ type: "subscribe", events: { since } });
  }
}

/** Returns the refusal in a problem of HTTP (RFC 9457) or in an `error` of the stream. */
export function refusalOf(body: unknown, status: number): Refusal {
  const problem = (body ?? {}) as { code?: number; detail?: string; message?: string; details?: Record<string, unknown> };
  return new Refusal(problem.code ?? 0, problem.detail ?? problem.message ?? `HTTP ${status}`, problem.details, status);
}

export type OperationName = keyof Operations;
