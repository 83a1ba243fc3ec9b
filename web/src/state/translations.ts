import { shallowReactive } from "vue";
import { ask } from "../api/ask.ts";
import { LONGEST_TEXT, MOST_TEXTS } from "../generated/bounds.ts";
import { language } from "../words/index.ts";
import { whenLive } from "./load.ts";
import { connection } from "./robot.ts";

/** Spanish texts by the English texts of the service. */
const known = shallowReactive(new Map<string, string>());
const MOST_KNOWN = 1000;

/** English texts whose translation the page needs. */
const wanted = new Set<string>();

let asking: Promise<void> | null = null;

/**
 * Returns a text of the service in the language of the page: a message, a reason, a remark.
 *
 * Texts that all readers share are English. The service translates them; until its answer arrives, they stay English.
 */
export function translated(text: string): string {
  if (language.value === "en" || text === "") return text;
  const found = known.get(text);
  if (found === undefined) want(text);
  return found ?? text;
}

/** Waits until a text is translated, so that it does not change before the reader's eyes, or cannot be. */
export async function untilTranslated(text: string): Promise<void> {
  translated(text);
  await asking;
}

function want(text: string): void {
  if (text.length > LONGEST_TEXT || wanted.size >= MOST_KNOWN) return;
  wanted.add(text);
  asking ??= fetchWanted().finally(() => (asking = null));
}

async function fetchWanted(): Promise<void> {
  await Promise.resolve(); // one request for all texts that a page shows at the same time
  try {
    while (wanted.size > 0 && connection.value === "live") {
      const texts = [...wanted].slice(0, MOST_TEXTS);
      const found = await ask("POST /v1/translations", { body: { texts, language: "es" } });
      if (known.size > MOST_KNOWN) known.clear();
      for (const [i, text] of texts.entries()) {
        wanted.delete(text);
        known.set(text, found[i] ?? text);
      }
    }
  } catch {
    // They stay English until the next text is asked for, or until the next connection.
  }
}

whenLive(() => {
  for (const text of wanted) want(text);
});
