import { KeyReused } from "../generated/codes.ts";
import { Refusal } from "../stream/stream.ts";

/** A request without an answer keeps its key for this time [ms]; after it, the person means another one. */
export const KEPT = 300_000;

/**
 * Idempotency keys of requests that must be carried out once. A request without an answer keeps its key: when a person
 * presses the button again, the service answers with the job that it has. After an answer, the next request gets a new key.
 */
export class Keys {
  private readonly unanswered = new Map<string, { key: string; since: number }>();

  /** `now` returns the time [ms]. */
  constructor(private readonly now: () => number = () => performance.now()) {}

  /** Sends a request with a key. `about` says what it asks for. */
  async use<Answer>(about: string, send: (key: string) => Promise<Answer>): Promise<Answer> {
    const before = this.unanswered.get(about);
    const kept = before !== undefined && this.now() - before.since < KEPT ? before : { key: newKey(), since: this.now() };
    this.unanswered.set(about, kept);
    try {
      const answer = await send(kept.key);
      this.unanswered.delete(about);
      return answer;
    } catch (error) {
      if (error instanceof Refusal && error.code === KeyReused) this.unanswered.delete(about);
      throw error;
    }
  }
}

/** Returns a random key; `crypto.randomUUID` is missing where the page came over http from another computer. */
function newKey(): string {
  return crypto.getRandomValues(new Uint32Array(4)).join("-");
}
