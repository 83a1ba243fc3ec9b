/**
 * The values that the browser keeps for the page. A browser may forbid this or have no space left, and then throws an error; the page
 * works all the same, stop first of all, and keeps the values in memory until it is closed.
 */
class Kept {
  private readonly memory = new Map<string, string>();

  constructor(private readonly storage: () => Storage) {}

  /** Returns the value of a key, null for none. */
  get(key: string): string | null {
    const here = this.memory.get(key);
    if (here !== undefined) return here;
    try {
      return this.storage().getItem(key);
    } catch {
      return null;
    }
  }

  /** Keeps a value; "" keeps none. */
  set(key: string, value: string): void {
    this.memory.set(key, value);
    try {
      this.storage().removeItem(key); // an old value must not come back if the new one is too large
      if (value) this.storage().setItem(key, value);
      this.memory.delete(key);
    } catch {
      // it is in memory
    }
  }
}

/** Kept for this browser. */
export const forBrowser = new Kept(() => localStorage);

/** Kept for this tab, over a reload. */
export const forTab = new Kept(() => sessionStorage);
