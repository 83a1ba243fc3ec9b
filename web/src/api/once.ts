import { Unreachable } from "../stream/stream.ts";

/**
 * Idempotency keys of requests that must be carried out once. A request whose answer was lost keeps its key: when a person
 * presses the button again, the service answers with the job that it has. Every other request gets a new key.
 */
export class Keys {
  private readonly unanswered = new Map<string, string>();

  /** Sends a request with a key. `about` says what it asks for. */
  async use<Answer>(about: string, send: (key: string) => Promise<Answer>): Promise<Answer> {
    const key = this.unanswered.get(about) ?? newKey();
    this.unanswered.set(about, key);
    try {
      const answer = await send(key);
      this.unanswered.delete(about);
      return answer;
    } catch (error) {
      if (!(error instanceof Unreachable)) this.unanswered.delete(about);
      throw error;
    }
  }
}

/** Returns a random key; `crypto.randomUUID` is missing where the page came over http from another computer. */
function newKey(): string {
  return crypto.getRandomValues(new Uint32Array(4)).join("-");
}
