import { ref } from "vue";
import { Refusal, Unreachable } from "../stream/stream.ts";
import { COMMON } from "../words/common.ts";
import { t } from "../words/index.ts";

export interface Failure {
  code: number;
  message: string;
  details: Record<string, unknown>;
}

/** Returns a failure as the page shows it. */
export function failureOf(error: unknown): Failure {
  if (error instanceof Refusal) return { code: error.code, message: error.message, details: error.details };
  if (error instanceof Unreachable) return { code: 0, message: t(COMMON.unreachable), details: {} };
  return { code: 0, message: error instanceof Error ? error.message : String(error), details: {} };
}

/**
 * One request of a person: whether it is under way, and how it failed. Each card has its own, so a refusal is shown
 * beside what was clicked.
 */
export function useAction() {
  const busy = ref(false);
  const failure = ref<Failure | null>(null);
  async function run<Result>(work: () => Promise<Result>): Promise<Result | undefined> {
    if (busy.value) return undefined;
    busy.value = true;
    failure.value = null;
    try {
      return await work();
    } catch (error) {
      failure.value = failureOf(error);
      return undefined;
    } finally {
      busy.value = false;
    }
  }
  return { busy, failure, run };
}
